// Where a back-projection's lines of sight, which leave the wall at right angles, meet surfaces.
#pragma once
#include <vector>

#include "optim/reconstruct/back_projection.h"

namespace isochron {

struct SheetMaximum {
  double depth = 0;   ///< metres, between voxels by a parabola
  double albedo = 0;  ///< the parabola's top
  double border = 0;  ///< the albedo that ends the surface here
  int voxel = 0;      ///< along the depth
};

/// Of each line, [up][across], those of its maxima along the depth that are a surface's, by depth:
/// - significance and albedo reach what the back-projection asks for;
/// - the albedo is at least half of the largest one at the same depth within one and a half lateral resolutions: to there the edge of a
///   flat sheet looks blurred, its middle being where half is left;
/// - it is two depth resolutions or more behind the one before.
std::vector<std::vector<SheetMaximum>> sheet_maxima(const BackProjection& volume);

}  // namespace isochron
