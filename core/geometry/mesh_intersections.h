// Where triangles pass through each other: lines along which what is seen changes from one surface to the other though
// neither has an edge there.
#pragma once
#include <array>
#include <vector>

#include "core/geometry/triangle_clusters.h"

namespace isochron {

/// The segment that two triangles have in common. They may share a vertex, its one end.
struct MeshIntersection {
  std::array<int, 2> triangle;  ///< ascending
  std::array<Vec3, 2> end;
};

/// All pairs that cross, by triangles, kept while vertices move: what has moved is searched again. A segment ends where an
/// edge of one triangle goes through the other. What merely touches is not found.
class MeshIntersections {
 public:
  /// Searches everywhere. `touching`: within this distance of its end an edge goes through nothing; at least 2^-20 of the
  /// largest coordinate.
  MeshIntersections(const Scene& at_first, double touching);
  /// `scene` has the topology of the initial one. Self-intersections of rigid shapes are found once, in the initial scene.
  /// The result does not depend on earlier updates.
  void update(const Scene& scene, double touching);
  const std::vector<MeshIntersection>& segments() const { return segments_; }

 private:
  /// An edge of the first triangle, or of the second, goes through the other here.
  struct EdgeHit {
    std::array<int, 2> triangle;
    int edge;
    Vec3 point;
  };
  /// Edges whose first face is in one cluster, with boxes that overlap those of the triangles that they go through.
  struct ClusterEdge {
    int number;  ///< of Scene::edges
    std::array<int, 2> vertex;
  };
  struct ClusterEdges;

  /// Those of shapes that have moved; `all_edges`: also within shapes that do not deform.
  void find_hits(const Scene& scene, const std::vector<char>& moved, bool all_edges);
  /// For each shape, those that its edges are to be tried against.
  std::vector<std::vector<int>> partners(const Scene& scene, const std::vector<char>& moved, bool all_edges) const;
  void fill(const Scene& scene, ClusterEdges& edges) const;
  // A cluster's edges, or one of them, against the triangles below a node or of another cluster. Their boxes overlap.
  void test_cluster(const Scene& scene, ClusterEdges& edges, const TriangleClusters::Node& node,
                    std::vector<EdgeHit>& hits) const;
  void test_edge_against_node(const Scene& scene, const ClusterEdge& edge, const FloatBox& box,
                              const TriangleClusters::Node& node, std::vector<EdgeHit>& hits) const;
  void test_edge_against_cluster(const Scene& scene, const ClusterEdge& edge, const FloatBox& box,
                                 const TriangleCluster& cluster, std::vector<EdgeHit>& hits) const;
  void try_edge(const Scene& scene, const ClusterEdge& edge, int triangle, std::vector<EdgeHit>& hits) const;
  void join(const Scene& scene);

  TriangleClusters clusters_;
  std::vector<ClusterEdge> edges_;          ///< cluster by cluster
  std::vector<int> first_edge_;             ///< of each cluster, and the end
  std::vector<char> through_own_shape_;     ///< of each edge: in the initial scene
  std::vector<char> shape_pierces_itself_;  ///< one of its edges does
  std::vector<Vec3> positions_;             ///< at the last update
  double touching_;
  std::vector<EdgeHit> hits_;
  std::vector<MeshIntersection> segments_;
};

}  // namespace isochron
