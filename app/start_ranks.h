#pragma once
#include <string>

namespace isochron {

/// Where mpirun (or srun) started the program: joins the other ranks (core/base/ranks.h) and keeps all but the first from
/// printing. Throws InputError where the program was built without MPI, or its library is missing.
void start_ranks();
/// Reports an error that other ranks may not have had. Where there are others, ends them all; else returns the exit status.
int fail_alone(const std::string& what);
/// To be called with the exit status before the program ends, which it returns.
int end_ranks(int status);

}  // namespace isochron
