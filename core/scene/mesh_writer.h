#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/scene/scene.h"

namespace isochron {

/// A number for each of the shape's vertices.
struct VertexProperty {
  std::string name;
  std::vector<double> values;
};

/// A shape's mesh where it is in the scene, as the contents of a file: the vertices of the file that it was read from, faces
/// in the order and orientation of Scene::triangles, in double precision. Properties are NaN where a vertex has no face.
std::string to_ply(const Scene& scene, const Shape& shape,
                   std::span<const VertexProperty> properties = {});  ///< binary, little-endian
std::string to_obj(const Scene& scene, const Shape& shape,
                   std::span<const VertexProperty> properties = {});  ///< with all digits; OBJ has no properties

/// All of them.
struct MeshFormat {
  const char* name;  ///< in experiments, and of the files' ends
  const char* meaning;
  std::string (*write)(const Scene&, const Shape&, std::span<const VertexProperty>);
};
std::span<const MeshFormat> mesh_formats();

}  // namespace isochron
