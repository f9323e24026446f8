#include "optim/run/loop.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

/// In a row: then the user is told. Where a step is as likely to be rejected as not, as at a minimum, they are told
/// once in 32 iterations at most.
constexpr int kToldRejections = 5;

bool all_finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double v) { return std::isfinite(v); });
}

/// Whether the image's error is below `rmse`, beyond doubt.
bool agree(const Evaluation& now, double rmse) {
  return rmse > 0 && now.mean_squared_error + 2 * now.mean_squared_error_noise <= rmse * rmse;
}

bool exploded(const Evaluation& now, const Checkpoint& state) {
  return now.loss - 3 * now.loss_noise >
         kDivergedLossRatio * (std::max(0.0, state.loss_initial) + 3 * state.loss_noise_initial);
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
    Evaluation now = optimizer.evaluate(objective, state.theta, iteration);
    if (state.iteration == 0) {
      state.loss_initial = now.loss;
      state.loss_noise_initial = now.loss_noise;
    }
    Descent descent(options.iterations, state.descent);
    const std::string hidden = descent.observe(state.iteration, state.theta, now.loss, now.loss_noise);
    options.row(now, state.theta, false);

    const bool finite = std::isfinite(now.loss) && all_finite(now.gradient);
    const bool agrees = agree(now, options.converged_rmse);
    Safeguard safeguard(stop_window, state.safeguard);
    const Verdict verdict =
        safeguard.observe(now.loss, now.loss_noise, finite, state.theta,
                          within_bounds(now.gradient, state.theta, objective.lower(), objective.upper()));
    const bool last = state.iteration >= options.iterations;
    const bool diverged = verdict == Verdict::give_up || (last && (!finite || exploded(now, state)));
    if (agrees || diverged || verdict == Verdict::settled || last) {
      LoopResult result;
      std::vector<double> chosen = state.theta;
      if (agrees) {
        result.status = RunStatus::converged;
      } else if (diverged) {
        result.status = RunStatus::diverged;
        result.choice = FinalChoice::best;
        chosen = safeguard.state().best_theta;
      } else if (verdict == Verdict::settled) {
        result.status = RunStatus::converged;
        result.choice = FinalChoice::average;
        chosen = safeguard.settled_theta();
      } else if (optimizer.scatters() && descent.settled()) {
        result.choice = FinalChoice::average;
        chosen = descent.settled_theta();
      }
      if (chosen != state.theta) {
        now = objective.evaluate(chosen, iteration + 1);
        options.row(now, chosen, true);
      }
      result.final = std::move(now);
      state.safeguard = safeguard.state();
      state.descent = descent.state();
      state.theta = chosen;
      return result;
    }

    const auto warn = [&](const std::string& text) {
      if (options.warning) options.warning(fmt::format("iteration {}: {}", state.iteration, text));
    };
    if (!hidden.empty()) warn(hidden);
    std::vector<double> next;
    if (verdict == Verdict::reject) {
      optimizer.reset();
      descent.restart_average();
      next = safeguard.state().best_theta;
      warn(fmt::format("{}; continuing from the best parameters with {} of the rate",
                       finite ? "the loss has risen" : "loss or gradient is not finite", safeguard.state().rate));
    } else {
      next = optimizer.step(objective, std::move(now), state.theta, iteration, safeguard.state().rate);
      if (optimizer.stuck()) safeguard.restart_window();
      state.steps_rejected += optimizer.rejected();
      state.steps_rejected_in_row = optimizer.rejected() ? state.steps_rejected_in_row + 1 : 0;
      if (state.steps_rejected_in_row == kToldRejections)
        warn(
            fmt::format("{} iterations in a row found no lower loss and rejected their steps: a minimum, or noise "
                        "(samples)",
                        kToldRejections));
    }
    state.theta = next;
    state.optimizer = optimizer.state();
    state.safeguard = safeguard.state();
    state.descent = descent.state();
    ++state.iteration;
    options.save();
  }
}

}  // namespace isochron
