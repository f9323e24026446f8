// A surface for a fit to begin with.
#pragma once
#include "core/scene/mesh.h"
#include "optim/reconstruct/likely_albedos.h"

namespace isochron {

/// Of each line of sight the brightest voxels, as a fit needs them:
/// - where a line has at least 0.15 of the albedo that the part's light comes from, with a margin of half a resolution;
/// - in parts that end where the depth jumps. Those that have hardly any light, or are smaller than half of a disc as wide as the
///   resolution, are left out; those whose margins meet, at depths that a surface may have there, become one;
/// - smooth over half a resolution, without the steps of the grid at borders.
/// Counter-clockwise seen from the wall, manifold, in the capture's coordinates; empty where nothing is significant.
Mesh start_surface(const LikelyAlbedos& volume);

}  // namespace isochron
