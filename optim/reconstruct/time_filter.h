// Minus the second derivative of a gaussian along time: what is left of counts that do not change, or change evenly, is nothing.
#pragma once
#include <algorithm>
#include <optional>
#include <vector>

#include "core/gates/linear_density.h"
#include "optim/reconstruct/histograms.h"

namespace isochron {

/// How much later than it arrives light is counted, metres of optical path. Empty: as it arrives.
using DetectorResponse = std::optional<LinearDensity>;

/// The standard deviation of a gaussian that is as wide as the response at half of its height, with the variance of a bin's
/// width added. Metres.
double response_deviation(const DetectorResponse& response, double bin);

/// Lengths in metres of optical path.
struct TimeFilter {
  double sigma = 0;  ///< of the gaussian
  /// Of the filtered response to light of one path length: by how much its maximum is later, and its width at half of that.
  double delay = 0, width = 0;
};
TimeFilter time_filter(double sigma, const DetectorResponse& response, double bin);

/// Filtered counts and the variances that they have by the counts' own Poisson variance, ready to be interpolated linearly. (The
/// variance of an interpolated sum is no larger than that.) There is no value at times within two sigma of the first and last bin, where
/// the filter's positive part would not be whole.
class FilteredHistograms {
 public:
  FilteredHistograms(const Histograms& histograms, const TimeFilter& filter);

  struct Entry {
    float value = 0, variance = 0;            ///< at a bin's middle
    float value_step = 0, variance_step = 0;  ///< to those of the next bin
  };
  /// The first `steps()` entries of a row, one per bin, lead to the next one; what follows is zero.
  const Entry* row(std::size_t i) const { return &values_[i * stride()]; }
  int steps() const { return std::max(0, entries_ - 1); }
  int first() const { return first_; }  ///< bin of the first entry
  /// Bins at either end for which the filter has no value.
  static int margin(double sigma, double bin);

 private:
  std::size_t stride() const { return static_cast<std::size_t>(std::max(1, entries_)); }

  int first_, entries_;
  std::vector<Entry> values_;
};

}  // namespace isochron
