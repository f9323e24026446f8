// What an optimiser asks of the problem that it solves, and what it is told.
#pragma once
#include <cstdint>
#include <vector>

#include "core/image/image.h"

namespace isochron {

/// Estimates at one point.
struct Evaluation {
  GatedImage image;
  /// What is minimised, an estimate that is right on average; so it can lie below 0 where the least possible is 0.
  double loss = 0;
  double loss_noise = 0;  ///< standard error of `loss`, of a single evaluation
  /// Of the image's mismatch without penalties, unbiased as the loss, and its standard error.
  double mean_squared_error = 0, mean_squared_error_noise = 0;
  std::vector<double> gradient;  ///< of the loss, one entry per unknown
  /// Only from linearise(): the Gauss-Newton matrix of the loss, its second derivative where residuals are
  /// linear; symmetric, row after row. Two estimates from a noisy Jacobian, their difference is its noise:
  /// one from two independent halves of the samples (unbiased, may be indefinite), one from all of them at
  /// once (semidefinite, on average too large).
  std::vector<double> curvature, curvature_bound;
};

/// An entry (a, b), and (b, a), of a second derivative; a != b.
struct Coupling {
  int a, b;
  double curvature;
};

/// Several random draws, of which each has a number.
struct Probes {
  int first = 0, count = 1;
};

/// Probes of a diagonal that is used by itself. n of them know a single unknown's entry to a factor of about 1 +- sqrt(2 / n):
/// albedos average that out, but one tilt whose entry is several times too small runs away from what all else is fitted to.
/// With 3 before the first step, fits of hidden_s took twice the iterations of 12 or, of a chart of dots, ended 10 degrees off.
inline constexpr int kProbesOfDiagonal = 12;

/// A loss whose estimates depend only on theta and `iteration`: equal iterations share their random numbers,
/// so that differences between points of one iteration are far less noisy than the loss.
class Objective {
 public:
  virtual ~Objective() = default;
  /// Bounds of the unknowns, infinite where there is none; thetas below lie within.
  virtual const std::vector<double>& lower() const = 0;
  virtual const std::vector<double>& upper() const = 0;
  virtual double loss(const std::vector<double>& theta, std::uint32_t iteration) const = 0;
  /// Loss and gradient; `loss` is that of the function above. Residual and derivative come from independent
  /// random numbers.
  virtual Evaluation evaluate(const std::vector<double>& theta, std::uint32_t iteration) const = 0;
  /// The same of the first of so many equal parts of the samples, where the objective has samples; `loss` may be another.
  virtual Evaluation evaluate_part(const std::vector<double>& theta, std::uint32_t iteration, int /*parts*/) const {
    return evaluate(theta, iteration);
  }
  /// As evaluate, with curvatures.
  virtual Evaluation linearise(const std::vector<double>& theta, std::uint32_t iteration) const = 0;
  /// Estimates, >= 0, of the diagonal of the Gauss-Newton matrix J'WJ at theta: (J' W^(1/2) z)^2 with a random sign z for each
  /// reading, others for each probe, and W from the image of `now`, which is evaluate(theta, iteration). Noise of the Jacobian
  /// J makes it too large, on average; otherwise it has no bias. One costs about as much as a gradient, those
  /// that share a call less.
  virtual std::vector<std::vector<double>> probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                           const Evaluation& now, Probes probes) const = 0;
  /// What is known of the loss's second derivative beside its diagonal: the entries of a quadratic penalty. A pair of unknowns may
  /// come several times, and its entries add up.
  virtual std::vector<Coupling> couplings() const { return {}; }
};

}  // namespace isochron
