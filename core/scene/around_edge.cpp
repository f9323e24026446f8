#include "core/scene/around_edge.h"

#include <cmath>
#include <limits>
#include <tuple>

#include "core/base/constants.h"

namespace isochron {

NextAround next_around(const Vec3& axis, std::span<const Vec3> inward, int i) {
  // From one reference for all: rounding may exchange two half-planes, but no sector is lost or found twice.
  const auto angle_of = [&](int k) {
    if (k == 0) return 0.0;
    const double angle = std::atan2(dot(axis, cross(inward[0], inward[k])), dot(inward[0], inward[k]));
    return angle < 0 ? angle + 2 * kPi : angle;
  };
  const double own = angle_of(i);
  std::tuple<bool, double, int> next{true, std::numeric_limits<double>::infinity(),
                                     -1};  // whether it is a turn further
  for (int k = 0; k < static_cast<int>(inward.size()); ++k) {
    const double angle = angle_of(k);
    const bool before = std::tie(angle, k) < std::tie(own, i);
    if (k != i) next = std::min(next, {before, angle, k});
  }
  const auto& [wrapped, angle, number] = next;
  return {number, angle - own + (wrapped ? 2 * kPi : 0)};
}

}  // namespace isochron
