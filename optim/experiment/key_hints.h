// Messages about maps that are missing, incomplete or no maps: they say which keys belong there.
#pragma once
#include "core/base/description.h"

namespace isochron {

/// read_keys, with the keys of the maps inside in its messages about them.
void read_keys_with_hints(const YamlValue& value, const Keys::Describe& describe);

}  // namespace isochron
