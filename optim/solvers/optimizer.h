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
  virtual std::vector<double> step(const Objective& objective, Evaluation now, const std::vector<double>& theta,
                                   std::uint32_t iteration, double rate) = 0;
  /// Whether the last step() stayed where it was because no point that it tried had a lower loss.
  virtual bool rejected() const { return false; }
  /// Whether the last step was refused although the gradient promised a fall above the loss's noise: losses that no longer change
  /// so are no sign of rest.
  virtual bool stuck() const { return false; }
  /// Whether each iteration solves the problem of its own random numbers, so that near the optimum the parameters of
  /// iterations scatter about it, and their mean is nearer to it than the last.
  virtual bool scatters() const { return false; }
  /// Forgets what it learnt, after a step was rejected.
  virtual void reset() = 0;
  virtual OptimizerState state() const = 0;
  virtual void restore(const OptimizerState& state) = 0;
};

/// As the experiment says: each method is a file of its own. The preconditioner, which must outlive it, is only for Adam.
/// `scales`, one > 0 per unknown (none: all 1): the method works on u = theta / scale, so that its steps mean the same for
/// unknowns of different units; callers see theta. With equal scales within each of a preconditioner's blocks, that acts on u
/// as it would on theta. Scales of 1 change no bit.
std::unique_ptr<Optimizer> make_optimizer(const OptimizerSpec& spec, const Preconditioner& preconditioner,
                                          const std::vector<double>& scales = {});

}  // namespace isochron
