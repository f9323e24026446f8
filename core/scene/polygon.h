// Polygons of mesh files, cut into triangles.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/base/vec.h"

namespace isochron {

/// Appends the triangles of a polygon, oriented as it is: a fan around the first corner where it is strictly convex, else
/// ears (corners whose triangle holds no other corner), so that corners on straight sides are kept. The polygon need not be
/// flat: what counts is its projection along the coordinate axis nearest to its normal (Newell's, the sum of the cross
/// products of consecutive corners). Sides may touch, as where a hole is joined to the outline. Corners that repeat the one
/// before are passed over; of a polygon without any area nothing is appended.
/// Returns what is wrong with it, or an empty text: sides that cross, or a concave polygon of more than 10000 corners (the
/// time grows with their square).
std::string cut_polygon(const std::vector<Vec3>& positions, const std::vector<int>& corners,
                        std::vector<std::array<int, 3>>& triangles);

}  // namespace isochron
