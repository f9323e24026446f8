// CPU seconds.
#pragma once
#include <time.h>

#include "core/base/ranks.h"

namespace isochron {

inline double cpu_seconds_of(clockid_t clock) {
  timespec now;
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Of all threads of all ranks (ranks.h) so far. Collective: every rank gets the same sum, so that all decide alike by it.
inline double cpu_seconds() {
  return sum_over_ranks(cpu_seconds_of(CLOCK_PROCESS_CPUTIME_ID));
}

/// Puts the CPU seconds that its thread spends during its life where it is told; null: nowhere.
class ThreadTimed {
 public:
  explicit ThreadTimed(double* seconds) : seconds_(seconds), start_(seconds ? now() : 0) {}
  ThreadTimed(const ThreadTimed&) = delete;
  ThreadTimed& operator=(const ThreadTimed&) = delete;
  ~ThreadTimed() {
    if (seconds_) *seconds_ = now() - start_;
  }

 private:
  static double now() { return cpu_seconds_of(CLOCK_THREAD_CPUTIME_ID); }
  double* const seconds_;
  const double start_;
};

}  // namespace isochron
