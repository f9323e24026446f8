// Shapes that lie on each other: triangles with the same three corners.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace isochron {

/// Two shapes and how many triangles they have in common: equal positions (0 and -0 are equal) at the
/// corners, in any order. Which of two such triangles a ray meets is undefined, and ellipsoidal sampling
/// takes light from both. Within one mesh `clean_mesh` sees to it that there are none. A surface that is cut
/// into other triangles, or covered in part, is not found.
struct Coincidence {
  std::array<int, 2> shape;  ///< ascending
  int triangles;
};

/// By ascending shapes. Of more than two triangles with the same corners each is paired with the one before
/// it.
std::vector<Coincidence> find_coincidences(const Scene& scene);

/// One line that names the shapes; empty where there are none.
std::string coincidence_warning(const Scene& scene);

}  // namespace isochron
