// A surface for a fit to begin with.
#pragma once
#include "core/scene/mesh.h"
#include "optim/reconstruct/likely_albedos.h"

namespace isochron {

/// What the wall sees first (FirstSurface::depth), in triangles of about a lateral resolution, as a fit needs it:
/// - with a margin of a lateral resolution beyond what is significant: steep parts send little light, so that back-projection misses
///   them, and a fit draws a border back more easily than it extends one;
/// - without small holes, which the margin closes, and without the steps of the grid at borders;
/// - smooth over a lateral resolution.
/// Pieces whose margins meet, at depths that a surface may have there, become one part; others may overlap, seen from the wall.
/// Counter-clockwise seen from the wall, manifold, in the capture's coordinates; empty where nothing is significant.
Mesh start_surface(const LikelyAlbedos& volume);

}  // namespace isochron
