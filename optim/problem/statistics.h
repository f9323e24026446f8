// Means and standard errors from replicates: independent estimates of one thing, each from a part of the samples.
#pragma once
#include <cstddef>
#include <vector>

#include "core/films/replicates.h"
#include "core/image/image.h"

namespace isochron {

/// Of some quantities, each estimated by the mean over `replicates`.
struct Statistics {
  std::vector<double> mean, standard_error;
  /// Of freedom of the standard error, for Student's law; infinite where it is zero.
  std::vector<double> degrees;
  /// How many independent deviations of one size would vary as much among each other as those that make up the standard
  /// error, (sum of squares)^2 / (sum of fourth powers): a third of their number where they are normal and of one size,
  /// near 1 where a single rare one makes all of it (heavy_tail.h). Infinite where the standard error is zero.
  std::vector<double> effective_count;
  int replicates = 0;

  /// Of the interval about the mean of quantity i that covers the truth in 95 % of all estimates, by Student's law; in fewer where
  /// the deviations are very skewed.
  double half_width_95(std::size_t i) const;
};

/// Replicates of some numbers, weighted by their samples.
class ReplicateStatistics {
 public:
  void add(const std::vector<double>& replicate, int samples);
  /// The same, where the numbers are sums of parts: [part][number], as many in every replicate. A part's own deviations say
  /// more about rare large contributions than those of the sum.
  void add(const std::vector<double>& replicate, std::vector<std::vector<double>> parts, int samples);
  /// At least two replicates.
  Statistics result() const;

 private:
  std::vector<std::vector<double>> replicates_;
  std::vector<std::vector<std::vector<double>>> parts_;  ///< [replicate][part][number]; empty: none given
  std::vector<double> samples_;
};

/// Of the averages over pixels and channels, one per gate, from at least two replicates.
/// Where pixels are independent (Renderer::pixels_are_independent) the variance of a mean over pixels is a sum of those of
/// the pixels: two replicates then give as many degrees of freedom as there are pixels.
Statistics gate_statistics(const GateSums& sums, int pixels, bool pixels_are_independent);

/// Replicates of an image, where each is made as a whole.
class ImageStatistics {
 public:
  explicit ImageStatistics(bool pixels_are_independent) : independent_(pixels_are_independent) {}

  void add(GatedImage image, int samples);
  GatedImage mean() const;
  /// As gate_statistics().
  Statistics gates() const;

 private:
  bool independent_;
  std::vector<GatedImage> images_;
  std::vector<double> samples_;
};

/// Of a sum of independent quantities: variances add, and degrees and effective counts by Welch and Satterthwaite's formula.
Statistics sum_of(const std::vector<const Statistics*>& terms);

/// Replicates that estimates of so many samples are split into: few, so that low-discrepancy numbers keep their gain. At
/// most `most` where replicates are all that tells the error; two where independent pixels do. More where there are so few
/// pixels that they and the replicates together would make less than 31 degrees of freedom, at most 32.
int replicate_count(int samples, int pixels, bool pixels_are_independent, int most);

}  // namespace isochron
