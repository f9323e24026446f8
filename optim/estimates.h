// Images, derivatives and gradients with standard errors from independent batches of samples.
#pragma once
#include <string>
#include <vector>

#include "core/image/image.h"
#include "optim/problem.h"

namespace isochron {

/// At most so many batches; fewer where there are fewer samples per pixel.
inline constexpr int kMostBatches = 32;

/// Mean and standard error of the mean of some quantities.
struct Statistics {
  std::vector<double> mean, standard_error;
  /// Fourth central moment of the batches over the square of the second: about 3 where they are normal and the
  /// standard error means what it says, up to their number where a single one stands out (see heavy_tail.h); 0 where
  /// all are equal.
  std::vector<double> kurtosis;
};

/// Collects independent batches, weighted by their samples.
class BatchStatistics {
 public:
  void add(const std::vector<double>& batch, int samples);
  /// At least two batches.
  Statistics result() const;

 private:
  std::vector<std::vector<double>> batches_;
  std::vector<double> samples_;
};

struct ImageEstimate {
  GatedImage image;
  Statistics gates;  ///< of the average over pixels and channels, one entry per gate
};

/// The gated images at theta. Throws InputError when samples.primal is below 2.
ImageEstimate estimate_image(const Problem& problem, const std::vector<double>& theta, const Poll& poll);

/// One component of the derivative images of a range of unknowns.
struct DerivativeEstimate {
  std::string component;           ///< total, interior, visibility or path_length
  std::vector<GatedImage> images;  ///< one per unknown
  std::vector<Statistics> gates;   ///< one per unknown, as in ImageEstimate
};

/// Derivative images of the unknowns [first, first + count) at theta: `total` first, then the terms with
/// samples. The finite-difference method gives `total` alone, from samples.primal. Throws InputError when a
/// term has one sample.
std::vector<DerivativeEstimate> estimate_derivatives(const Problem& problem, const std::vector<double>& theta,
                                                     int first, int count, const Poll& poll);

struct GradientEstimate {
  Statistics gradient;  ///< one entry per unknown
  int repeats = 0;      ///< independent estimates of residual and derivative that the samples were split into
};

/// Number of repeats that estimate_gradient makes. Throws InputError when a term has one sample.
int gradient_repeats(const Problem& problem);

/// The gradient of the loss at theta. All repeats together use the experiment's samples once. Throws as
/// above.
GradientEstimate estimate_gradient(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                                   const Poll& poll);

}  // namespace isochron
