// Mesh edges as visibility boundaries: their geometry and how they are picked (theory section 5).
#pragma once
#include <memory>
#include <vector>

#include "core/base/large_array.h"
#include "core/paths/path_differential.h"
#include "core/paths/prepared_scene.h"
#include "core/techniques/edge_choice.h"

namespace isochron {

class MeshIntersections;

/// An edge at the current parameters, or the line along which two triangles pass through each other. Two cache lines: of
/// many edges each is a wait for main memory.
struct alignas(64) BoundaryEdge {
  Vec3 origin, end;
  int vertex[2] = {-1, -1};  ///< -1 of the line along which two triangles intersect
  int face[2];               ///< face[1] is -1 on an open border
  Vec3 inward[2];            ///< unit, in the plane of face i, perpendicular to the edge, pointing into the face
  /// Angle that directions are drawn from, on either side: that of the wedge of grazing directions, which is pi less the
  /// angle between the faces (pi on an open border), or, without it, pi.
  double azimuths = 0;
  bool moves = false;

  int faces() const { return face[1] < 0 ? 1 : 2; }
  /// Whether it is no mesh edge but the line along which two triangles intersect, both of which go on beyond it.
  bool is_mesh_intersection() const { return vertex[0] < 0; }
  Vec3 point(double s) const { return origin + (end - origin) * s; }
};
static_assert(sizeof(BoundaryEdge) == 128);

class BoundaryEdges {
 public:
  /// `wedge`: pick edges and azimuths by the wedge of grazing directions (see BoundaryTechniques).
  /// `at_first`: the same scene with the parameters' initial values, for MeshIntersections, outlives this; null: this one.
  explicit BoundaryEdges(const PreparedScene& scene, bool wedge = true, const Scene* at_first = nullptr);
  ~BoundaryEdges();
  BoundaryEdges(const BoundaryEdges&) = delete;
  BoundaryEdges& operator=(const BoundaryEdges&) = delete;
  /// Rebuilds the edges of shapes that PreparedScene::update has changed since the last call; `scene` is the same object. The
  /// result does not depend on earlier updates.
  void update(const PreparedScene& scene);

  /// Which edge, and where on it. The edge itself is prefetched.
  struct Pick {
    const BoundaryEdge* edge = nullptr;
    double s = 0;                 ///< fraction along the edge
    double begin = 0, share = 0;  ///< u from `begin` to `begin` + `share` draw this edge
    /// The u that draws this point.
    double x() const { return begin + s * share; }
  };
  struct Sample : Pick {
    Vec3 y;
    Vec3 tangent;    ///< unit, from the edge's origin to its end
    double pdf = 0;  ///< per length
    Sample() = default;
    explicit Sample(const Pick& picked);
  };
  /// Edges and intersections of meshes that the camera may see moving, by their length in the image and, inside of an
  /// outline, the angle between their faces; the same of static ones where points beside them may follow others, in equal
  /// shares. `u` in (0, 1).
  bool has_primary() const { return !primary_.choice.empty(); }
  Sample sample_primary(double u) const { return Sample(pick(primary_.choice, u)); }
  /// Edges that may come between two surfaces, by length times wedge; moving edges and static ones (which count
  /// where what lies behind or before them moves) get equal shares.
  bool has_secondary() const { return !secondary_.choice.empty(); }
  Sample sample_secondary(double u) const { return Sample(pick_secondary(u)); }
  /// The same in two steps, for callers with other work to do while the edge is read from memory.
  Pick pick_secondary(double u) const { return pick(secondary_.choice, u); }

  /// Which side of the plane through the edge with unit normal n_b its faces lie on: +1, -1, or 0 when they lie on
  /// both (no boundary) or the plane holds a face.
  static int occluder_side(const BoundaryEdge& edge, const Vec3& n_b);

  /// Adds n_b . (velocity of the edge at y), n_b being normal to the edge.
  static void add_velocity(const PreparedScene& scene, const Sample& point, const Vec3& n_b, LocalDifferential& out);

 private:
  /// How often each of edges_ is picked.
  struct Weighted {
    std::vector<double> weights;
    EdgeChoice choice;
  };
  /// The weights of an edge of the scene, which becomes edges_[i].
  void update_edge(const PreparedScene& scene, std::size_t i);
  void add_mesh_intersections(const PreparedScene& scene);
  /// Rebuilds the changed edges of a shape; false if there are none.
  bool update_shape(const PreparedScene& scene, int shape, bool all);
  void set_group(std::size_t group, int first, int count);
  Pick pick(const EdgeChoice& choice, double u) const;

  LargeArray<BoundaryEdge> edges_;   ///< those of the scene, then intersections of meshes
  std::vector<std::uint8_t> moves_;  ///< of each
  Weighted primary_, secondary_;     ///< a group per shape, and one of the intersections
  const Scene* at_first_;
  std::unique_ptr<MeshIntersections> intersections_;  ///< made when first asked for
  int revision_ = 0;                                  ///< of the scene
  const bool wedge_;
  bool camera_possible_ = false;
};

}  // namespace isochron
