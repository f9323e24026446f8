// Area-sampled shapes (hidden geometry sampling): a point of a path is drawn uniformly by area on the shapes that parameters
// change or that the user names (Shape::hidden), which a ray in a random direction may rarely meet.
#pragma once
#include <vector>

#include "core/base/discrete_distribution.h"
#include "core/base/vec.h"

namespace isochron {

class HiddenGeometry {
 public:
  HiddenGeometry() = default;
  /// Triangles by their areas.
  HiddenGeometry(std::vector<int> triangles, const std::vector<double>& areas)
      : triangles_(std::move(triangles)), distribution_(areas) {}

  bool empty() const { return triangles_.empty(); }
  /// Of every point on its triangles, per area.
  double pdf() const { return 1 / distribution_.total(); }
  /// `u` in (0, 1) is replaced by a fresh uniform number.
  int pick(double& u) const { return triangles_[distribution_.sample(u)]; }

 private:
  std::vector<int> triangles_;
  DiscreteDistribution distribution_;
};

/// The numbers of points in an order in which neighbours are close (Morton order), so that evenly spread random numbers pick
/// evenly spread points.
std::vector<int> spatial_order(const std::vector<Vec3>& points);

}  // namespace isochron
