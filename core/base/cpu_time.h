// CPU seconds so far of all threads of all ranks (ranks.h). Collective: every rank gets the same sum, so that all decide alike
// by it.
#pragma once
#include <time.h>

#include "core/base/ranks.h"

namespace isochron {

inline double cpu_seconds() {
  timespec now;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return sum_over_ranks(static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec));
}

}  // namespace isochron
