// Axis-aligned bounding boxes.
#pragma once
#include <algorithm>
#include <limits>

#include "core/base/vec.h"

namespace isochron {

struct Bounds {
  Vec3 low{kInfinity, kInfinity, kInfinity}, high{-kInfinity, -kInfinity, -kInfinity};

  void add(const Vec3& p) {
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], p[axis]);
      high[axis] = std::max(high[axis], p[axis]);
    }
  }
  void add(const Bounds& b) { add(b.low), add(b.high); }
  Vec3 center() const { return low * 0.5 + high * 0.5; }
  double half_area() const {
    const Vec3 d = high - low;
    return d.x * d.y + d.y * d.z + d.z * d.x;
  }
  Bounds grown(double margin) const {
    const Vec3 m{margin, margin, margin};
    return {low - m, high + m};
  }
  bool holds(const Vec3& p) const { return distance_squared(p) == 0; }
  bool overlaps(const Bounds& b) const {
    for (int axis = 0; axis < 3; ++axis)
      if (!(low[axis] <= b.high[axis] && b.low[axis] <= high[axis])) return false;
    return true;
  }
  bool meets_ray(const Vec3& origin, const Vec3& direction) const {
    double begin = 0, end = kInfinity;
    for (int axis = 0; axis < 3; ++axis) {
      if (direction[axis] == 0) {
        if (!(low[axis] <= origin[axis] && origin[axis] <= high[axis])) return false;
        continue;
      }
      const double t0 = (low[axis] - origin[axis]) / direction[axis],
                   t1 = (high[axis] - origin[axis]) / direction[axis];
      begin = std::max(begin, std::min(t0, t1));
      end = std::min(end, std::max(t0, t1));
    }
    return begin <= end;
  }
  double distance_squared(const Vec3& p) const {
    double squared = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double outside = std::max({low[axis] - p[axis], p[axis] - high[axis], 0.0});
      squared += outside * outside;
    }
    return squared;
  }

 private:
  static constexpr double kInfinity = std::numeric_limits<double>::infinity();
};

}  // namespace isochron
