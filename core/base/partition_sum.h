// Sums over partitions of work that do not depend on which thread takes which partition, nor on how many threads there are.
#pragma once
#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/base/cpu_time.h"
#include "core/base/parallel.h"
#include "core/base/ranks.h"

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

/// CPU seconds of each partition of a pass as ranks last ran it, the same on all of them: by these they share its next run.
/// Timing affects scheduling only, never results.
using PartitionCosts = std::vector<double>;

/// The partitions 0 ... count - 1 of a pass, shared among ranks.
class SharedPartitions {
 public:
  /// `last`: of the same pass, for this run to replace; null: partitions count alike.
  SharedPartitions(int partitions, PartitionCosts* last)
      : count(partitions),
        parts(count, last ? *last : PartitionCosts()),
        costs(rank_count() > 1 ? count : 0),
        last_(last) {}

  /// f(partition) for those of this rank.
  template <class F>
  void run(F&& f) {
    const RankPart own = parts.own();
    parallel(own.end - own.begin, [&](int i) {
      const int partition = own.begin + i;
      const ThreadTimed timed(costs.empty() ? nullptr : &costs[partition]);
      f(partition);
    });
  }
  /// Once all ranks know all costs.
  void keep_costs() {
    if (last_) *last_ = std::move(costs);
  }

  const int count;
  const RankParts parts;
  PartitionCosts costs;  ///< of this run, zero where not known; empty without ranks

 private:
  PartitionCosts* const last_;
};

/// The heap of sum_of_partitions.
class PartitionTree {
 public:
  PartitionTree(int leaves, const RankParts& parts) : leaves_(leaves), parts_(parts) {}
  int rank_of_first(int node) const { return parts_.rank_of(first_leaf(node)); }
  bool is_of_one_rank(int node) const {
    return rank_of_first(node) == parts_.rank_of(first_leaf(node) + leaves_below(node) - 1);
  }

 private:
  int leaves_below(int node) const { return leaves_ >> (std::bit_width(static_cast<unsigned>(node)) - 1); }
  int first_leaf(int node) const { return node * leaves_below(node) - leaves_; }

  const int leaves_;
  const RankParts& parts_;
};

/// A sum and what is known of its partitions' costs, from one rank to another.
template <class Sum>
std::string packed(const Sum& sum, const PartitionCosts& costs) {
  Packer packer;
  packer.put(costs);
  sum.pack(packer);
  return std::move(packer.bytes);
}
template <class Sum>
void unpack(const std::string& bytes, Sum& sum, PartitionCosts& costs) {
  Unpacker unpacker(bytes);
  PartitionCosts others;
  unpacker.get(others);
  for (std::size_t i = 0; i < costs.size(); ++i) costs[i] = std::max(costs[i], others[i]);
  sum.unpack(unpacker);
}

/// The sum of what partitions give, whose number is a power of two. run(partition) makes a Sum, which is movable, has a default
/// constructor, add(const Sum& of_later_partitions), and pack(Packer&) and unpack(Unpacker&) to reach other ranks. Sums are added along the
/// binary tree whose leaves are the partitions, by the thread that completes a pair: an order that is the same for any number of threads, where
/// few partial sums wait at a time (as many as threads, times the levels of the tree at most). Of several ranks each runs the partitions of its
/// part; a pair that two of them made is added by the one of the first half.
template <class Sum, class Run>
Sum sum_of_partitions(SharedPartitions& shared, Run&& run) {
  // A heap: nodes 2 n and 2 n + 1 are the halves of node n, the leaves begin at `count`.
  const int count = shared.count;
  std::vector<Sum> partial(2 * static_cast<std::size_t>(count));
  std::vector<std::atomic<bool>> half_done(count);
  const PartitionTree tree(count, shared.parts);
  shared.run([&](int partition) {
    int node = count + partition;
    partial[node] = run(partition);
    for (; node > 1 && tree.is_of_one_rank(node / 2); node /= 2) {
      if (!half_done[node / 2].exchange(true)) return;  // the other half continues from here
      Sum &first = partial[node & ~1], &second = partial[node | 1];
      first.add(second);
      second = Sum();
      partial[node / 2] = std::move(first);
    }
  });
  for (int node = count - 1; rank_count() > 1 && node > 0; --node) {
    if (tree.is_of_one_rank(node)) continue;
    const int first = tree.rank_of_first(2 * node), second = tree.rank_of_first(2 * node + 1);
    if (rank() == first) {
      if (second != first) unpack(receive(second), partial[2 * node + 1], shared.costs);
      partial[2 * node].add(partial[2 * node + 1]);
      partial[2 * node + 1] = Sum();
      partial[node] = std::move(partial[2 * node]);
    } else if (rank() == second) {
      send(first, packed(partial[2 * node + 1], shared.costs));
    }
  }
  if (rank_count() > 1) {
    std::string bytes = first_rank() ? packed(partial[1], shared.costs) : std::string();
    broadcast(bytes);
    unpack(bytes, partial[1], shared.costs);
    shared.keep_costs();
  }
  return std::move(partial[1]);
}

}  // namespace isochron
