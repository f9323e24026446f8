// Standard errors that a few rare samples make: found by the kurtosis of the batches behind them.
#pragma once
#include <string>
#include <vector>

namespace isochron {

/// A standard error is not to be trusted where the kurtosis of its batches (Statistics::kurtosis) exceeds
/// this: of 32 batches one then carries more than three eighths of all squared deviations. 32 normal batches
/// exceed it with a probability of 4e-6, fewer batches less often (by simulation). Fewer than 14 batches
/// never do, so with that few samples there is no warning.
inline constexpr double kHeavyTailKurtosis = 12;

/// Collects what is heavy-tailed among many estimates, for one line of warning.
class HeavyTails {
 public:
  /// `gate`: -1 for an estimate of all gates together. Estimates of one parameter follow each other.
  void add(const std::string& parameter, int gate, double kurtosis);
  /// Names parameters and gates and says what to do; empty when nothing is heavy-tailed.
  std::string warning() const;

 private:
  struct Entry {
    std::string parameter;
    std::vector<int> gates;
  };
  std::vector<Entry> entries_;
  double largest_ = 0;
};

}  // namespace isochron
