// How far surfaces are apart that the levels of a run have found, as an error of where it ends.
//
// Errors from the curvature of the loss are those of one minimum. Levels end in others: each begins on the surface of the one before, with
// other random numbers and triangles. Where outlines are undecided the surface moves most, and there the curvature's errors are too small by
// up to 3 (optim/README.md, Standard errors). So an error is at least the vertex's distance from the farthest of the earlier levels' surfaces.
#pragma once
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace isochron {

/// Surfaces that earlier levels found of a shape.
struct EarlierSurfaces {
  std::string shape;
  std::vector<std::string> meshes;  ///< files
};

/// Adds to the squares of a scene's errors by vertex (surface_errors) the square of the distance between the shape's vertex and the earlier
/// surface that is farthest from it. Throws InputError where one of them cannot be read.
void add_level_scatter(const EarlierSurfaces& earlier, const Scene& scene, std::vector<double>& errors);

}  // namespace isochron
