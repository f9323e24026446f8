// Polygons of mesh files, cut into triangles.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/base/vec.h"

namespace isochron {

/// Appends the triangles of a polygon, oriented as it is, two less than it has corners, so that its sides are theirs:
/// - seen along the coordinate axis nearest to its normal (Newell's, the sum of the cross products of consecutive corners)
///   strictly convex: a fan around the first corner;
/// - else, where it is flat, ears (corners whose triangle holds no other corner), so that corners on straight sides are kept;
/// - else the triangles of the least area together, as a floor and a wall in one polygon have no view without overlaps.
/// Sides may touch, as where a hole is joined to the outline. Corners that repeat the one before are passed over, and so is
/// what goes there and back the same way; of a polygon without any area nothing is appended.
/// Returns what is wrong with it, or an empty text: sides that cross, or a concave polygon of more than 10000 corners (the
/// time grows with their square).
std::string cut_polygon(const std::vector<Vec3>& positions, const std::vector<int>& corners,
                        std::vector<std::array<int, 3>>& triangles);

}  // namespace isochron
