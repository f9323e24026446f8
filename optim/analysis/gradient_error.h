// How good is an estimator of a gradient? Statistics of independent repeats against an independent reference:
// bias and variance apart, each with its standard error.
#pragma once
#include <span>
#include <vector>

namespace isochron {

/// Independent estimates of one vector, each of the same distribution.
using Repeats = std::vector<std::vector<double>>;

struct Measured {
  double value = 0, standard_error = 0;
};

/// Repeats that enter a combination with a weight.
struct WeightedRepeats {
  const Repeats* repeats;  ///< at least 4; vectors of one size in all groups
  double weight = 1;
};

struct SquaredNorm : Measured {
  double error_if_zero = 0;  ///< the standard error that it would have if the truth were zero
};

/// |sum of weight x expectation|^2 over the groups, unbiased: the squared norm of the combined means d less
/// what their noise adds on average, the trace of its covariance C. Hence negative at times where the truth b
/// is near zero. Variance of a quadratic form of a normal vector: 2 tr(C^2) + 4 b'Cb, where tr(C^2) and d'Cd
/// (on average tr(C^2) more than b'Cb) come from differences of repeats (a group of fewer than 12: tr(C^2) at
/// most). Near a truth of zero the error is too large by up to sqrt(2).
SquaredNorm squared_norm(std::span<const WeightedRepeats> groups);

/// Total variance (sum over components) of one repeat, from at least 2; the standard error is 0 for 2.
Measured total_variance(const Repeats& repeats);

std::vector<double> mean(const Repeats& repeats);

/// A method at one number of samples.
struct SampleLevel {
  double factor = 1;        ///< samples, in units of the experiment's
  double core_seconds = 0;  ///< of one repeat, on average
  Repeats repeats;
};

/// What a method's levels say together. All relative: variances and squares over the reference's squared norm.
struct MethodError {
  /// Variance x core-seconds, a constant by the law variance ~ 1 / time; the mean over the upper three levels.
  /// On lower ones products of two noises (of image and derivative) and fixed costs may still add to it: the
  /// slope is steeper then, and the rate of long estimates lower than this.
  Measured rate;
  double slope = 0;   ///< of log(standard deviation) over log(core-seconds), all levels; -1/2 by the law
  SquaredNorm bias2;  ///< squared bias, unbiased: may be negative
};

/// `scale` multiplies all squares: unknowns over the components in the repeats, where only some were measured.
/// `bias_from_all`: the bias is taken not to depend on the samples, so that all levels tell it (else the
/// uppermost alone).
MethodError method_error(const std::vector<SampleLevel>& levels, const Repeats& reference, double norm2, double scale,
                         bool bias_from_all);

/// Whether a squared bias is more than 3 times the error it would have if there were none. Without a bias and
/// with normal noise that happens with probability 2.2 % (one unknown; less with more).
bool significant(const SquaredNorm& bias2);

/// Core-seconds until sqrt(variance + bias^2) is `error`, relative to the gradient's norm, counting a bias
/// only where it is significant; the standard error is that of the rate. Infinite where the bias alone
/// is more.
Measured core_seconds_to(double error, const MethodError& method);

}  // namespace isochron
