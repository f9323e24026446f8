// What lights a scene: which emitter a path goes to, and how far any is. Emitters are triangles of shapes with `emission`, and
// lights without an extent (index_of_light); points on them are PreparedScene::point_on_emitter's.
#pragma once
#include <vector>

#include "core/base/discrete_distribution.h"
#include "core/geometry/nearest_box.h"

namespace isochron {

class Emitters {
 public:
  Emitters() = default;
  /// Emitters in a fixed order, with area x radiance (or the like) of each, and boxes that hold them.
  Emitters(std::vector<int> triangles, const std::vector<double>& power, std::vector<Bounds> boxes)
      : triangles_(std::move(triangles)), distribution_(power), boxes_(std::move(boxes)) {}

  bool empty() const { return triangles_.empty(); }
  const std::vector<int>& triangles() const { return triangles_; }
  /// Of all of them.
  double power() const { return distribution_.total(); }

  /// One of them, in proportion to its power; `u` in (0, 1).
  int pick(double u) const { return triangles_[distribution_.sample(u)]; }
  /// Prefetches what pick(u) will read.
  void prefetch(double u) const { __builtin_prefetch(&triangles_[distribution_.prefetch(u)]); }

  /// Lower bound of the distance from p to an emitter; infinite where there is none.
  double distance(const Vec3& p) const { return std::sqrt(boxes_.distance_squared(p)); }

  bool have_extent = false;     ///< some of them
  bool seen_by_camera = false;  ///< may be, if nothing is in between

 private:
  std::vector<int> triangles_;
  DiscreteDistribution distribution_;
  NearestBox boxes_;
};

}  // namespace isochron
