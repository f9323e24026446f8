// Hidden shapes that a capture cannot see, as they are not in front of its wall.
#pragma once
#include <string>

#include "core/scene/scene.h"

namespace isochron {

/// Complains of hidden shapes that lie on or behind the wall at a sensor point; empty where all is well. A shape in the wall's
/// plane is the wall itself.
std::string behind_wall(const Scene& scene);

}  // namespace isochron
