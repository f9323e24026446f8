// What the noise of an experiment's loss gradient costs, measured.
#pragma once
#include <array>
#include <limits>
#include <vector>

#include "optim/analysis/sample_split.h"
#include "optim/problem/problem.h"

namespace isochron {

/// Variance and cost of the loss gradient of one setting at one point.
struct GradientCost {
  GradientVariance variance;  ///< in the units of PointInspection::gradient
  PerPass seconds{};          ///< CPU seconds per sample per pixel; 0 of a pass that is not run
  double overhead = 0;        ///< CPU seconds per evaluation, independent of the samples
  /// Of the gradient's batches, by their squared distances from the mean over all unknowns; for one unknown
  /// that of Statistics. Below kFewestDeviations the variance is not to be trusted.
  double effective_count = std::numeric_limits<double>::infinity();
};

/// The experiment's numbers of samples, or fewer (at least one, of images two), with which measure_cost takes about so many
/// CPU seconds.
std::array<int, kPasses> affordable_samples(const Problem& problem, const std::vector<double>& theta,
                                            const GatedImage& target, const std::array<bool, 3>& kept, double seconds);

/// Of the problem's setting at theta, for the terms that `kept` says, against a target image. `samples`: of
/// the passes that are repeated for it; settings compared with the same numbers have common random numbers.
GradientCost measure_cost(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                          const std::array<bool, 3>& kept, const std::array<int, kPasses>& samples);

}  // namespace isochron
