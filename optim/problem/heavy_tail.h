// Standard errors that a few rare samples make: found by how few deviations make up the variance.
#pragma once
#include <string>
#include <vector>

namespace isochron {

/// A standard error whose Statistics::effective_count is below this rests on a few rare samples and is not to be trusted, as
/// others may have been missed. 31 normal deviations of one variance come out below with probability 5e-4, more of them less
/// often (by simulation).
inline constexpr double kFewestDeviations = 4;

/// Collects what is heavy-tailed among many estimates, for one line of warning.
class HeavyTails {
 public:
  /// `gate`: -1 for an estimate of all gates together. Estimates of one parameter follow each other.
  void add(const std::string& parameter, int gate, double effective_count);
  /// Names parameters and gates and says what to do; empty when nothing is heavy-tailed.
  std::string warning() const;

 private:
  struct Entry {
    std::string parameter;
    std::vector<int> gates;
  };
  std::vector<Entry> entries_;
  double smallest_ = 0;
};

}  // namespace isochron
