// Sizes that can be rendered.
#pragma once
#include <cmath>

#include "core/base/vec.h"

namespace isochron {

/// Largest coordinate of a vertex or the camera that can be rendered: Embree multiplies three of them in single precision,
/// which overflows from 7e12 on, and ends the program where one exceeds 1.8e18.
inline constexpr double kLargestCoordinate = 1e12;
/// Whether all three are at most that, and none is NaN.
inline bool coordinates_fit(const Vec3& p) {
  return std::abs(p.x) <= kLargestCoordinate && std::abs(p.y) <= kLargestCoordinate &&
         std::abs(p.z) <= kLargestCoordinate;
}

}  // namespace isochron
