#include "optim/loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace isochron {
namespace {

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

}  // namespace

const char* name(RunStatus status) {
  constexpr const char* kNames[] = {"converged", "iterations_reached", "diverged", "interrupted"};
  return kNames[static_cast<int>(status)];
}

const char* name(FinalChoice choice) {
  constexpr const char* kNames[] = {"last", "average", "best"};
  return kNames[static_cast<int>(choice)];
}

LoopResult run_loop(const Objective& objective, Optimizer& optimizer, int stop_window, const LoopOptions& options,
                    Checkpoint& state) {
  if (!state.optimizer.empty()) optimizer.restore(state.optimizer);
  for (;;) {
    const auto iteration = static_cast<std::uint32_t>(state.iteration);
    const Evaluation now = optimizer.evaluate(objective, state.theta, iteration);
    if (state.iteration == 0) state.loss_initial = now.loss;
    options.row(now, state.theta, false);

    const bool finite = std::isfinite(now.loss) && all_finite(now.gradient);
    const bool agrees = options.converged_rmse > 0 && std::sqrt(now.mean_squared_error) <= options.converged_rmse;
    Safeguard safeguard(stop_window, state.safeguard);
    const Verdict verdict = safeguard.observe(now.loss, finite, state.theta);
    const bool last = state.iteration >= options.iterations;
    const bool diverged =
        verdict == Verdict::give_up || (last && (!finite || now.loss > kDivergedLossRatio * state.loss_initial));
    if (agrees || diverged || verdict == Verdict::settled || last) {
      LoopResult result;
      std::vector<double> chosen = state.theta;
      if (agrees) {
        result.status = RunStatus::converged;
      } else if (diverged) {
        result = {RunStatus::diverged, FinalChoice::best};
        chosen = safeguard.state().best_theta;
      } else if (verdict == Verdict::settled) {
        result = {RunStatus::converged, FinalChoice::average};
        chosen = safeguard.settled_theta();
      }
      if (chosen != state.theta) options.row(optimizer.evaluate(objective, chosen, iteration + 1), chosen, true);
      state.safeguard = safeguard.state();
      state.theta = chosen;
      return result;
    }

    std::vector<double> next;
    if (verdict == Verdict::reject) {
      optimizer.reset();
      next = safeguard.state().best_theta;
      if (options.warning)
        options.warning(fmt::format("iteration {}: {}; going on from the best parameters with {} of the rate",
                                    state.iteration, finite ? "the loss has risen" : "loss or gradient is not finite",
                                    safeguard.state().rate));
    } else {
      next = optimizer.step(objective, now, state.theta, iteration, safeguard.state().rate);
    }
    state.theta = next;
    state.optimizer = optimizer.state();
    state.safeguard = safeguard.state();
    ++state.iteration;
    options.save();
  }
}

}  // namespace isochron
