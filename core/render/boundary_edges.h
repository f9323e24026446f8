// Mesh edges as visibility boundaries: their geometry and how they are picked (theory section 5).
#pragma once
#include "core/render/path_differential.h"
#include "core/render/prepared_scene.h"

namespace isochron {

/// An edge at the current parameters, or the line along which two triangles pass through each other.
struct BoundaryEdge {
  bool pierced = false;  ///< such a line: both faces go on beyond it, and it has no vertices
  int vertex[2] = {-1, -1};
  int face[2];  ///< face[1] is -1 on an open border
  Vec3 origin, end;
  Vec3 tangent;  ///< unit, from origin to end
  double length = 0;
  Vec3 inward[2];      ///< unit, in the plane of face i, perpendicular to the edge, pointing into the face
  double opening = 0;  ///< angle between the two inward directions; 0 on an open border
  int faces() const { return face[1] < 0 ? 1 : 2; }
  Vec3 point(double s) const { return origin + (end - origin) * s; }
  /// Angle of the wedge of grazing directions on either side: pi less the opening.
  double wedge() const { return kPi - opening; }
  double azimuths = 0;  ///< angle that directions are drawn from, on either side: the wedge or, without it, pi
};

class BoundaryEdges {
 public:
  /// `wedge`: pick edges and azimuths by the wedge of grazing directions (see BoundaryTechniques).
  explicit BoundaryEdges(const PreparedScene& scene, bool wedge = true);

  struct Sample {
    const BoundaryEdge* edge = nullptr;
    double s = 0;  ///< fraction along the edge
    Vec3 y;
    double pdf = 0;               ///< per length
    double begin = 0, share = 0;  ///< the edge takes the numbers from `begin` to `begin` + `share`
    /// The number that gives this point.
    double x() const { return begin + s * share; }
  };
  /// Edges and lines of piercing triangles that the camera may see moving, by their length in the image and, inside of an
  /// outline, the angle between their faces; the same of static ones where points beside them may follow others, in equal
  /// shares. `u` in (0, 1).
  bool has_primary() const { return !primary_.distribution.empty(); }
  Sample sample_primary(double u) const { return primary_.sample(u); }
  /// Edges that may come between two surfaces, by length times wedge; moving edges and static ones (which count
  /// where what lies behind or before them moves) get equal shares.
  bool has_secondary() const { return !secondary_.distribution.empty(); }
  Sample sample_secondary(double u) const { return secondary_.sample(u); }

  /// Which side of the plane through the edge with unit normal n_b its faces lie on: +1, -1, or 0 when they lie on
  /// both (no boundary) or the plane holds a face.
  static int occluder_side(const BoundaryEdge& edge, const Vec3& n_b);

  /// Adds n_b . (velocity of the edge at y), n_b being normal to the edge.
  static void add_velocity(const PreparedScene& scene, const Sample& point, const Vec3& n_b, LocalDifferential& out);

 private:
  /// Edges to pick from by weight; where there are both, moving and static ones get equal shares.
  struct Choice {
    std::vector<BoundaryEdge> edges;
    std::vector<double> weights;
    std::vector<char> moving;
    DiscreteDistribution distribution;
    void add(const BoundaryEdge& edge, double weight, bool moves);
    void finish();
    Sample sample(double u) const;
  };
  Choice primary_, secondary_;
  void add_piercings(const PreparedScene& scene, bool wedge);
};

}  // namespace isochron
