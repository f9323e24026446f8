#pragma once
#include <string>

namespace isochron {

/// The contents of an EXR file whose header OpenEXR can be trusted with. OpenEXR allocates whatever an
/// attribute declares before it finds the file too short, and does not notice where one is shorter or longer
/// than its type. So the attributes that describe the pixels are checked here, and all others are given a
/// type that OpenEXR does not know and skips. Throws InputError where the file cannot be opened,
/// std::runtime_error where it is no EXR file of one part, in scanlines or tiles.
std::string read_checked_exr(const std::string& file);

}  // namespace isochron
