// Places where a mesh is folded upon itself.
#pragma once
#include "core/scene/mesh.h"

namespace isochron {

/// The same triangles where hardly any two neighbours turn by more than 120 degrees: inner ends of such an edge move to the middle of their
/// neighbours, again and again. Vertices of borders stay: moved along them, borders of thin parts would fold the more. Steps of a fit that
/// are long beside the triangles leave folds, which are narrower than an edge and no property of a surface: their light is nearly that of the
/// surface without them, but they bend without bound. Edges that turn that much on purpose are blunted, too. `mesh` is a manifold.
Mesh unfolded(Mesh mesh);

}  // namespace isochron
