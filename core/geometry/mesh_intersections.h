// Where triangles pass through each other: lines along which what is seen changes from one surface to the other though
// neither has an edge there.
#pragma once
#include <array>
#include <vector>

#include "core/geometry/ray_caster.h"

namespace isochron {

/// The segment that two triangles have in common. They may share a vertex, its one end.
struct MeshIntersection {
  std::array<int, 2> triangle;  ///< ascending
  std::array<Vec3, 2> end;
};

/// All pairs that cross, by triangles. A segment ends where an edge of one triangle goes through the other, which a ray along
/// each of the scene's edges finds. What merely touches is not found.
std::vector<MeshIntersection> find_mesh_intersections(const Scene& scene, const RayCaster& caster);

/// The same, again and again while vertices move, by the edges that may cross something: those near another shape, those of
/// shapes that deform, and those that go through their own shape in the scene at first.
class CrossingEdges {
 public:
  explicit CrossingEdges(const Scene& at_first);
  /// `scene` has the topology of the one at first.
  std::vector<MeshIntersection> find(const Scene& scene, const RayCaster& caster) const;

 private:
  std::vector<char> through_own_shape_;  ///< per edge
  std::vector<int> shape_;               ///< per edge
};

}  // namespace isochron
