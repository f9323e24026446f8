// Meshes are read by OpenMesh (mesh_file.cpp), after a check (mesh_check.cpp) for what OpenMesh would get
// wrong without saying so: it takes what is not a number for zero, skips vertices, which shifts the indices
// of those behind, passes on indices of vertices that do not exist, and takes colors or comments for data.
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace isochron {

/// What OpenMesh has to find in a file.
struct CheckedMeshFile {
  std::string contents;                 ///< of text and PLY only what OpenMesh has to see
  bool binary = false;                  ///< of PLY or STL
  std::optional<std::size_t> vertices;  ///< not known of STL: OpenMesh joins equal ones
  std::size_t faces = 0;                ///< with three different corners; OpenMesh may drop others
};

/// Checks that the file holds as much as it declares, that every coordinate is a finite float, and every
/// index that of a vertex. `extension` is ".obj", ".off", ".ply" or ".stl". Throws InputError `FILE[:LINE]:
/// what is wrong`, with lines counted from one.
CheckedMeshFile check_mesh_file(const std::string& file, const std::string& extension, std::string contents);

/// Whether three of the vertices differ.
bool has_three_corners(const std::vector<int>& vertices);

}  // namespace isochron
