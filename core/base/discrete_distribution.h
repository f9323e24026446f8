// A random choice in proportion to given weights.
#pragma once
#include <algorithm>
#include <concepts>
#include <vector>

namespace isochron {

/// Discrete distribution by cumulative sums. A larger random number draws the same or a larger index, so that points that
/// are spread evenly stay so.
class DiscreteDistribution {
 public:
  DiscreteDistribution() = default;
  /// Weights are finite and not negative.
  explicit DiscreteDistribution(const std::vector<double>& weights)
      : DiscreteDistribution(weights.size(), [&](std::size_t i) { return weights[i]; }) {}
  /// Of `count` weights, each of which weight_of(i) gives.
  template <std::invocable<std::size_t> F>
  DiscreteDistribution(std::size_t count, F&& weight_of) : below_(count + 1), first_(count + 1) {
    double sum = 0;
    for (std::size_t i = 0; i < count; ++i) below_[i + 1] = sum += weight_of(i);
    // Every index is noted at the first part that begins within or behind its share, the last of several stays, and parts
    // without one take that of the part before.
    const double parts = size(), per_weight = parts / sum;
    for (int i = 1; i < size(); ++i) {
      const double part = below_[i] * per_weight;
      first_[part < parts ? static_cast<int>(part) + 1 : size()] = i;
    }
    for (int part = 1; part < size(); ++part) first_[part] = std::max(first_[part], first_[part - 1]);
  }
  bool empty() const { return total() <= 0; }
  double total() const { return below_.back(); }
  /// Probability of all indices before i.
  double below(int i) const { return below_[i] / total(); }
  double probability(int i) const { return (below_[i + 1] - below_[i]) / total(); }

  /// Prefetches what sample(u) reads where all weights are about equal; returns the index that it then draws.
  int prefetch(double u) const {
    const int i = guess(u);
    __builtin_prefetch(&below_[i]);
    return i;
  }
  /// Index drawn in proportion to its weight, of a distribution that is not empty; `u` in (0, 1) is replaced by a fresh
  /// uniform number.
  int sample(double& u) const {
    const double target = u * total();
    // Right where all weights are equal, so that a draw waits for memory once; else the search starts from a table.
    int i = guess(u);
    if (!(below_[i] <= target && target < below_[i + 1])) i = search(target, first_[i]);
    u = std::clamp((target - below_[i]) / (below_[i + 1] - below_[i]), 0x1p-53, 1 - 0x1p-53);
    return i;
  }

 private:
  int size() const { return static_cast<int>(below_.size()) - 1; }

  int guess(double u) const { return std::min(static_cast<int>(u * size()), size() - 1); }

  /// The index whose share holds `target`; the search starts at `near` in steps that double.
  int search(double target, int near) const {
    int low = near, high = near;  // below_[low] <= target < below_[high], or `high` is the end
    for (int step = 1; low > 0 && target < below_[low]; step *= 2) {
      high = low;
      low = std::max(low - step, 0);
    }
    for (int step = 1; high < size() && below_[high] <= target; step *= 2) {
      low = high;
      high = std::min(high + step, size());
    }
    const auto begin = below_.begin();
    auto after = std::upper_bound(begin + low, begin + high + 1, target);
    // Rounding can carry the target to the very end, where trailing entries may have no weight.
    if (after == below_.end()) after = std::lower_bound(begin, below_.end(), total());
    return static_cast<int>(after - begin) - 1;
  }

  std::vector<double> below_{0.0};  ///< [i]: sum of the weights before index i; one more than weights
  std::vector<int> first_;          ///< [k]: about the index whose share holds k of size() equal parts of the sum
};

}  // namespace isochron
