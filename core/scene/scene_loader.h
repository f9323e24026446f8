#pragma once
#include <string>

#include "core/base/description.h"
#include "core/scene/scene.h"

namespace isochron {

/// Reads a scene file with the meshes it names (paths relative to the scene file), transformed and welded.
/// Throws InputError `FILE:LINE:COLUMN: KEY: what is wrong (what is allowed)`, in one line.
Scene load_scene(const std::string& file);

/// Tables of a scene file's keys, in Markdown.
std::string scene_reference();

}  // namespace isochron
