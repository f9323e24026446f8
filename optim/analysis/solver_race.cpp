#include "optim/analysis/solver_race.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

#include "core/base/cpu_time.h"
#include "core/base/error.h"
#include "optim/analysis/methods.h"
#include "optim/experiment/choices.h"
#include "optim/problem/rendered_objective.h"
#include "optim/problem/vector_math.h"
#include "optim/run/loop.h"

namespace isochron {
namespace {

/// L-BFGS's first trial step over Adam's step: whole ones threw it off the cube in two runs of three.
constexpr double kFirstStep = 0.5;

/// Ends a run from within.
struct TimeIsUp {};

RaceRun race(const Problem& problem, const GatedImage& target, double core_seconds) {
  const Experiment& experiment = problem.experiment();
  const Parameters& parameters = problem.parameters();
  const std::unique_ptr<Optimizer> optimizer =
      make_optimizer(experiment.optimizer, problem.preconditioner(), parameters.scales());
  const RenderedObjective objective(problem, target);
  problem.estimator();  // its trial is no part of a run
  RaceRun run{name_of(experiment.optimizer.method), experiment.seed, {{0, 0, 1}}};
  Checkpoint state;
  state.theta = parameters.initial();
  const double before = parameters.distance_to_target(state.theta), start = cpu_seconds();
  LoopOptions options;
  options.iterations = std::numeric_limits<int>::max() - 2;
  options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
  options.save = [&] {
    const double time = cpu_seconds() - start;
    run.points.push_back({state.iteration, time, parameters.distance_to_target(state.theta) / before});
    if (time > core_seconds) throw TimeIsUp();
  };
  try {
    run_loop(objective, *optimizer, 0, options, state);
  } catch (const TimeIsUp&) {
  }
  return run;
}

}  // namespace

void require_error(const Problem& problem) {
  const Parameters& parameters = problem.parameters();
  if (!parameters.target_known() || !(parameters.distance_to_target(parameters.initial()) > 0))
    throw InputError(problem.experiment().file +
                     ": parameters: no error to follow (each needs a target, not all equal to initial)");
}

Race race_solvers(const Experiment& experiment, const GatedImage& target, const RaceOptions& options) {
  Race result;
  result.error = options.error;
  const double each = options.core_seconds / static_cast<double>(kChoices<OptimizerMethod>.size() * options.seeds);
  ProgressStage stage("racing the optimisers", static_cast<int>(kChoices<OptimizerMethod>.size()) * options.seeds);
  for (const auto& [method, name, meaning] : kChoices<OptimizerMethod>) {
    options.progress(name);
    for (int s = 0; s < options.seeds; ++s) {
      Experiment own = experiment;
      own.optimizer.method = method;
      own.seed += static_cast<std::uint64_t>(s);
      if (method == OptimizerMethod::lbfgs) own.optimizer.learning_rate *= kFirstStep;
      if (method != OptimizerMethod::adam)
        for (ParameterSpec& parameter : own.parameters) parameter.diffusion = 0;
      const Problem problem(own);
      try {
        require_optimisable(problem);
      } catch (const InputError& error) {
        result.notes.push_back(error.what());
        break;
      }
      result.runs.push_back(race(problem, target, each));
      stage.advance();
    }
  }
  return result;
}

int arrival(const RaceRun& run, double error) {
  int first = static_cast<int>(run.points.size());
  while (first > 0 && run.points[first - 1].error <= error) --first;
  return first < static_cast<int>(run.points.size()) ? first : -1;
}

std::string race_csv(const Race& race) {
  std::string text = "method,seed,iteration,core_seconds,error\n";
  for (const RaceRun& run : race.runs)
    for (const RacePoint& p : run.points)
      text += fmt::format("{},{},{},{},{}\n", run.method, run.seed, p.iteration, p.core_seconds, p.error);
  return text;
}

std::string race_table(const Race& race) {
  std::string text =
      fmt::format("{:<20}  {:>16}  {:>22}  {:>24}\n", "method", fmt::format("runs below {:.3g} %", 100 * race.error),
                  "core-seconds, median", "error at the end");
  for (std::size_t begin = 0, end = 0; begin < race.runs.size(); begin = end) {
    std::vector<double> times, errors;
    for (; end < race.runs.size() && race.runs[end].method == race.runs[begin].method; ++end) {
      const RaceRun& run = race.runs[end];
      if (const int first = arrival(run, race.error); first >= 0) times.push_back(run.points[first].core_seconds);
      errors.push_back(100 * run.points.back().error);
    }
    const auto [least, most] = std::minmax_element(errors.begin(), errors.end());
    text += fmt::format("{:<20}  {:>16}  {:>22}  {:>24}\n", race.runs[begin].method,
                        fmt::format("{} of {}", times.size(), errors.size()),
                        times.empty() ? "-" : fmt::format("{:.3g}", median(times)),
                        fmt::format("{:.3g} to {:.3g} %", *least, *most));
  }
  for (const std::string& note : race.notes) text += note + "\n";
  return text;
}

}  // namespace isochron
