// The order of half-planes about their common edge: which face of a mesh is next to which where more than two meet.
#pragma once
#include <span>

#include "core/base/vec.h"

namespace isochron {

/// The half-plane that comes next, and the angle to it, in [0, 2 pi].
struct NextAround {
  int number;
  double angle;
};

/// Of half-planes about the unit vector `axis`: what comes after number i, counter-clockwise seen against the axis. `inward`
/// holds a vector into each, the first perpendicular to the axis; there are at least two. Each is next to exactly one other,
/// and the angles sum to 2 pi: of those that coincide the one of the smaller number comes first.
NextAround next_around(const Vec3& axis, std::span<const Vec3> inward, int i);

}  // namespace isochron
