// The loop around an optimiser: evaluate, judge, step. Knows no files.
//
// Row i is the evaluation at the parameters before step i, with the random numbers of iteration i: N steps have the rows 0
// to N. At the end row N + 1 is evaluated where the final parameters are not those of row N.
//
// Final parameters: the mean over the last window where the loss has settled (see safeguard.h), over the last three quarters of
// the iterations where those of the optimiser scatter and the loss no longer falls (see descent.h); those of the
// lowest level where the optimisation diverged; else the last. Not those of the least loss: near the optimum
// that picks noise.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "optim/run/checkpoint.h"
#include "optim/solvers/optimizer.h"

namespace isochron {

enum class RunStatus { converged, iterations_reached, diverged, interrupted };
const char* name(RunStatus status);

enum class FinalChoice { last, average, best };
const char* name(FinalChoice choice);

/// A run that ends with more than this times the loss it began with has diverged; both losses are taken three standard
/// errors to the benefit of the doubt.
inline constexpr double kDivergedLossRatio = 10;

struct LoopOptions {
  int iterations = 100;
  /// Ends the loop once the image's mean squared error lies two standard errors below the square of this (where it is
  /// not below, one row says so wrongly with probability 0.023); 0: never. So it cannot be reached where noise is larger.
  double converged_rmse = 0;
  /// After every evaluation, before the step; `closing`: of the final parameters.
  std::function<void(const Evaluation& now, const std::vector<double>& theta, bool closing)> row;
  std::function<void()> save;                       ///< after every step, with the state ready for a checkpoint
  std::function<void(const std::string&)> warning;  ///< one line
};

struct LoopResult {
  RunStatus status = RunStatus::iterations_reached;
  FinalChoice choice = FinalChoice::last;
  Evaluation final = {};  ///< at the final parameters
};

/// Goes on from `state`, whose theta lies within the bounds, and keeps it up to date; at the end its theta
/// holds the final parameters. What the objective throws leaves the state as it was before the iteration.
LoopResult run_loop(const Objective& objective, Optimizer& optimizer, int stop_window, const LoopOptions& options,
                    Checkpoint& state);

}  // namespace isochron
