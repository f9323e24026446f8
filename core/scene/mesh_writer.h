#pragma once
#include <span>
#include <string>

#include "core/scene/scene.h"

namespace isochron {

/// A shape's mesh where it is in the scene, as the contents of a file: the vertices of the file that it was read from, faces
/// in the order and orientation of Scene::triangles, in double precision.
std::string to_ply(const Scene& scene, const Shape& shape);  ///< binary, little-endian
std::string to_obj(const Scene& scene, const Shape& shape);  ///< with all digits

/// All of them.
struct MeshFormat {
  const char* name;  ///< in experiments, and of the files' ends
  const char* meaning;
  std::string (*write)(const Scene&, const Shape&);
};
std::span<const MeshFormat> mesh_formats();

}  // namespace isochron
