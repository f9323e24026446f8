#pragma once
#include <string>
#include <vector>

namespace isochron {

/// A file to be written elsewhere.
struct FileCopy {
  std::string original;  ///< path it was read from
  std::string name;      ///< path below the new folder
  std::string contents;
  std::string checksum;  ///< of the original; the copy of a scene file may differ from it
};

/// Reads a file as it is. Throws InputError.
FileCopy copy_of_file(const std::string& original, const std::string& name);

/// `name`, or where it is one of `taken` the first free of STEM_2.EXTENSION, STEM_3.EXTENSION, ...
std::string free_name(const std::string& name, const std::vector<FileCopy>& taken);

/// A scene file, first, and the meshes it names: together they can be put into any folder. Meshes below the scene's folder
/// keep their place; others go into a folder `elsewhere`. Only then the scene file is changed: it is rewritten, without
/// comments, with the same values. Throws InputError when a file cannot be read; a scene that load_scene
/// accepts has no other errors.
std::vector<FileCopy> copy_of_scene(const std::string& file);

/// Text of a scene file for another `folder`: as `file` says, but that the shape of that name is the mesh in `mesh`, without a
/// transform; paths are relative to the folder.
std::string scene_with_mesh(const std::string& file, const std::string& shape, const std::string& mesh,
                            const std::string& folder);

}  // namespace isochron
