// From a back-projection to a triangle mesh that faces the wall.
#pragma once
#include <vector>

#include "core/scene/mesh.h"
#include "optim/reconstruct/back_projection.h"

namespace isochron {

struct FirstSurface {
  Mesh mesh;  ///< capture's coordinates, metres; counter-clockwise seen from the wall; a part for each sheet
  std::vector<double> albedo;  ///< of each vertex, relative: the mean is 1
  /// [up][across] of the volume: distance from the wall of the first surface on each line; not a number where there is none.
  std::vector<double> depth;
};

/// Vertices lie on lines of sight a lateral resolution apart (sheet_maxima), neighbours are joined unless the depth between them jumps
/// by more than twice their distance: a steeper surface, at 63 degrees, sends too little light to be told from a jump. A sheet
/// ends between two lines, where its albedo at the same depth falls below that of a border. Sheets smaller than half of a disc as wide
/// as the resolution are left out: a single point looks larger. Empty where nothing is significant.
FirstSurface first_surface(const BackProjection& volume);

}  // namespace isochron
