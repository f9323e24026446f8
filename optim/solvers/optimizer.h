// The optimisers behind one interface. Each is fed by run_loop (loop.h), which owns theta and rejects what
// fails.
#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "optim/experiment/experiment.h"
#include "optim/problem/objective.h"
#include "optim/problem/smoothing.h"

namespace isochron {

/// All that a resumed optimiser needs, by name.
using OptimizerState = std::map<std::string, std::vector<double>>;

class Optimizer {
 public:
  virtual ~Optimizer() = default;
  /// What step() needs at theta.
  virtual Evaluation evaluate(const Objective& objective, const std::vector<double>& theta,
                              std::uint32_t iteration) const {
    return objective.evaluate(theta, iteration);
  }
  /// Where one iteration leads from theta, within the bounds. `now` is evaluate(objective, theta, iteration);
  /// its loss and gradient are finite. Every step is shortened by `rate`, in (0, 1].
  virtual std::vector<double> step(const Objective& objective, const Evaluation& now, const std::vector<double>& theta,
                                   std::uint32_t iteration, double rate) = 0;
  /// Whether the last step() stayed where it was because no point that it tried had a lower loss.
  virtual bool rejected() const { return false; }
  /// Whether each iteration solves the problem of its own random numbers, so that near the optimum the parameters of
  /// iterations scatter about it, and their mean is nearer to it than the last.
  virtual bool scatters() const { return false; }
  /// An estimate of the diagonal of the Gauss-Newton matrix, where it has one; else empty.
  virtual std::vector<double> curvature_diagonal() const { return {}; }
  /// Forgets what it learnt, after a step was rejected.
  virtual void reset() = 0;
  virtual OptimizerState state() const = 0;
  virtual void restore(const OptimizerState& state) = 0;
};

/// Adam (adam.h). The preconditioner must outlive it.
std::unique_ptr<Optimizer> make_adam(double learning_rate, const Preconditioner& preconditioner,
                                     const RateDecay& decay = {});

/// L-BFGS of Ceres. One iteration makes up to `inner_iterations` steps, each with a line search (strong Wolfe
/// conditions), all on the random numbers of that iteration; the pairs that approximate the curvature are
/// gathered anew, since they are of use only on one and the same function. The point of least loss among all
/// that were tried is kept. Bounds: the loss is evaluated at the nearest point within them and is constant
/// beyond. The first trial step of each iteration has the length `first_step` (largest component, > 0); no
/// unknown moves further than 10 times that in one iteration.
std::unique_ptr<Optimizer> make_lbfgs(double first_step, int inner_iterations);

/// Levenberg-Marquardt of Ceres on the linearised objective. One iteration is one accepted step; trial points
/// that Ceres rejects cost an image each. The radius of the trust region is carried from one iteration to the
/// next.
std::unique_ptr<Optimizer> make_levenberg_marquardt();

/// L-BFGS within bounds, scaled by the diagonal of the Gauss-Newton matrix, which random signs estimate: needs no rate and no
/// scales. One iteration makes up to `inner_iterations` steps, all on its random numbers. Diagonal and pairs are carried from
/// one iteration to the next: each pair is a difference on common random numbers, whichever they were.
std::unique_ptr<Optimizer> make_quasi_newton(int inner_iterations);

/// `inner` works on u = theta / scale, one scale > 0 per unknown, so that its steps mean the same for unknowns of
/// different units; its callers see theta. With equal scales within each of a preconditioner's blocks, that
/// acts on u as it would on theta. Scales of 1 change no bit.
std::unique_ptr<Optimizer> make_scaled(std::unique_ptr<Optimizer> inner, const std::vector<double>& scales);

/// As the experiment says; the preconditioner is for Adam alone. No scales: all 1.
std::unique_ptr<Optimizer> make_optimizer(const OptimizerSpec& spec, const Preconditioner& preconditioner,
                                          const std::vector<double>& scales = {});

}  // namespace isochron
