// The normal of a wall of which only points are known.
#pragma once
#include <optional>
#include <vector>

#include "core/base/vec.h"

namespace isochron {

/// Unit normal of the plane that fits the points best, by least squares; its largest component is positive. Empty where
/// they lie on a line, or are one.
std::optional<Vec3> plane_normal(const std::vector<Vec3>& points);

}  // namespace isochron
