// What lies beside the program: in its build folder, or where app/packaging installs it, seen from the program. So an
// installation can be moved as a whole.
#pragma once
#include <string>

namespace isochron {

/// The folder that Python finds the package isochron in.
std::string package_folder();

/// Path of the module that joins ranks by MPI; there is no such file where it was not built.
std::string mpi_module();

}  // namespace isochron
