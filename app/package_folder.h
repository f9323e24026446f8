#pragma once
#include <string>

namespace isochron {

/// The folder that Python finds the package isochron in: `python` beside the program, as in a build folder, else where an
/// installation has it, seen from the program. So an installation can be moved as a whole.
std::string package_folder();

}  // namespace isochron
