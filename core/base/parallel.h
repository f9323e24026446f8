// Work shared out to threads. Results must not depend on who does what: see partition_sum.h.
#pragma once
#include <functional>

namespace isochron {

/// Threads that renderers use; 0: all cores. Results do not depend on it. May be called while other threads are in
/// `parallel`, which then go on with those that they began with.
void set_thread_count(int threads);

/// f(0) ... f(count - 1), in any order, on as many threads as set. Counts as progress (progress.h). Throws Interrupted once
/// a stop is requested, and what f throws, after all threads have left f.
void parallel(int count, const std::function<void(int)>& f);

}  // namespace isochron
