#pragma once
#include <array>
#include <string>

#include "core/base/yaml_reader.h"
#include "core/scene/scene.h"

namespace isochron {

/// Reads a scene file with the meshes it names (paths relative to the scene file), transformed and welded.
/// Throws InputError `FILE:LINE:COLUMN: KEY: what is wrong (what is allowed)`, in one line.
Scene load_scene(const std::string& file);

/// An image's size: [width, height].
std::array<int, 2> read_resolution(const YamlValue& value);

}  // namespace isochron
