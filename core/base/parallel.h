// Work shared out to threads. Results must not depend on who does what: see partition_sum.h.
#pragma once
#include <cstddef>
#include <functional>

namespace isochron {

/// Threads that renderers use; 0: all cores. Results do not depend on it. May be called while other threads are in
/// `parallel`, which then go on with those that they began with.
void set_thread_count(int threads);

/// f(0) ... f(count - 1), in any order, on as many threads as set. Counts as progress (progress.h). Throws Interrupted once
/// a stop is requested, and what f throws, after all threads have left f.
void parallel(int count, const std::function<void(int)>& f);

/// f(begin, end) of ranges that together are [0, count): loops over large arrays, of which each number is for itself. Is no progress and
/// not stopped, so that no array is left half done.
void parallel_ranges(std::size_t count, const std::function<void(std::size_t, std::size_t)>& f);
/// The same in ranges of `range`.
void parallel_ranges(std::size_t count, std::size_t range, const std::function<void(std::size_t, std::size_t)>& f);

}  // namespace isochron
