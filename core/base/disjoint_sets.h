// Sets of numbers that are joined pair by pair (union-find with path halving).
#pragma once
#include <cstddef>
#include <numeric>
#include <vector>

namespace isochron {

/// At first each of the numbers from 0 to count - 1 is a set by itself.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int root(int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(int i, int j) { parent_[root(i)] = root(j); }
  /// Numbers the sets from 0 on, in the order of their first members; returns each member's.
  std::vector<int> numbered(int& count) {
    std::vector<int> number(parent_.size(), -1), result(parent_.size());
    count = 0;
    for (std::size_t i = 0; i < parent_.size(); ++i) {
      int& n = number[root(static_cast<int>(i))];
      if (n < 0) n = count++;
      result[i] = n;
    }
    return result;
  }

 private:
  std::vector<int> parent_;
};

}  // namespace isochron
