// Sums over partitions of work that do not depend on which thread takes which partition, nor on how many threads there are.
#pragma once
#include <atomic>
#include <cstddef>
#include <utility>
#include <vector>

#include "core/base/parallel.h"

namespace isochron {

inline constexpr int kFewestPartitions = 32, kMostPartitions = 256;

/// Partitions for work of so many samples, where each has `values` sums of its own: a power of two, and as many as keep what
/// they add below a tenth of the work. A sample takes a microsecond or more, to clear a sum and to add it to another about a
/// nanosecond. At least 32: of sums so many that this costs more, samples touch few, and the others cost next to nothing
/// (SparseSum).
inline int partition_count(double samples, std::size_t values) {
  int partitions = kMostPartitions;
  while (partitions > kFewestPartitions && partitions * static_cast<double>(values) > 100 * samples) partitions /= 2;
  return partitions;
}

/// The sum of what the partitions 0 ... count - 1 give; count is a power of two. run(partition) makes a Sum, which is
/// movable, has a default constructor and add(const Sum& of_later_partitions). Sums are added along the binary tree whose
/// leaves are the partitions, by the thread that completes a pair: an order that is the same for any number of threads,
/// where few partial sums wait at a time (as many as threads, times the levels of the tree at most).
template <class Sum, class Run>
Sum sum_of_partitions(int count, Run&& run) {
  // A heap: nodes 2 n and 2 n + 1 are the halves of node n, the leaves begin at `count`.
  std::vector<Sum> partial(2 * static_cast<std::size_t>(count));
  std::vector<std::atomic<bool>> half_done(count);
  parallel(count, [&](int partition) {
    int node = count + partition;
    partial[node] = run(partition);
    for (; node > 1; node /= 2) {
      if (!half_done[node / 2].exchange(true)) return;  // the other half goes on from here
      Sum &first = partial[node & ~1], &second = partial[node | 1];
      first.add(second);
      second = Sum();
      partial[node / 2] = std::move(first);
    }
  });
  return std::move(partial[1]);
}

}  // namespace isochron
