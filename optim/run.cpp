#include "optim/run.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <limits>

#include "core/image/image.h"
#include "core/math/error.h"
#include "optim/checkpoint.h"
#include "optim/files.h"
#include "optim/log.h"
#include "optim/loss.h"
#include "optim/problem.h"

namespace isochron {
namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

double norm(const std::vector<double>& v) {
  double sum = 0;
  for (double x : v) sum += x * x;
  return std::sqrt(sum);
}

double distance_to_target(const Parameters& parameters, const std::vector<double>& theta) {
  double sum = 0;
  for (std::size_t i = 0; i < theta.size(); ++i) {
    const double error = theta[i] - parameters.target()[i];
    sum += error * error;
  }
  return std::sqrt(sum / static_cast<double>(theta.size()));
}

/// Everything a run writes, experiment.yaml first: without it a half-cleared folder is no run.
void clear_run(const std::string& folder) {
  for (const char* file :
       {"experiment.yaml", "checkpoint.yaml", "checkpoint.previous.yaml", "log.csv", "summary.yaml",
        "target.exr", "initial.exr", "final.exr", "target.png", "initial.png", "final.png", "rmse.png"})
    std::filesystem::remove(std::filesystem::path(folder) / file);
}

/// Renames a folder to the first free of FOLDER.1, FOLDER.2, ... so that no run is ever overwritten by accident.
std::string set_aside(const std::string& folder) {
  const std::string base = std::filesystem::path(folder + "/").parent_path().string();
  for (int i = 1;; ++i) {
    const std::string kept = fmt::format("{}.{}", base, i);
    if (std::filesystem::exists(kept)) continue;
    std::error_code error;
    std::filesystem::rename(base, kept, error);
    if (error)
      throw InputError(fmt::format("{}: holds a run already, which cannot be moved to {}: {} (allowed: -o for another "
                                   "folder, --force to overwrite)", base, kept, error.message()));
    return kept;
  }
}

std::string optional_number(double value) {
  return std::isnan(value) ? "null" : std::isinf(value) ? (value > 0 ? ".inf" : "-.inf") : exact(value);
}

class Run {
 public:
  Run(const Problem& problem, const RunOptions& options)
      : problem_(problem), parameters_(problem.parameters()), options_(options) {}

  RunStatus execute() {
    std::string warning;
    const auto saved = load_checkpoint(options_.folder, parameters_, &warning);
    if (!warning.empty() && options_.warning) options_.warning(warning);
    if (saved) state_ = *saved;
    if (!saved) state_.theta = parameters_.initial();
    last_.loss = last_.image_rmse = last_.param_rmse = kUnknown;
    RunStatus status;
    try {
      load_target();
      status = iterate();
    } catch (const Interrupted&) {
      save_checkpoint(options_.folder, state_, parameters_);
      status = RunStatus::interrupted;
    }
    write_summary(status);
    return status;
  }

 private:
  std::string path(const char* file) const { return options_.folder + "/" + file; }

  void poll() const {
    if (options_.stop && options_.stop()) throw Interrupted{};
  }

  void load_target() {
    const std::string file = path("target.exr");
    if (!std::filesystem::exists(file)) write_exr(file, problem_.make_target([this] { poll(); }));
    target_ = problem_.read_target(file);
  }

  RunStatus iterate() {
    const OptimizerSpec& optimizer = problem_.experiment().optimizer;
    const double converged_rmse = optimizer.tolerance * root_mean_square(target_);
    Log log(path("log.csv"), parameters_, state_.iteration);
    const auto call_start = std::chrono::steady_clock::now();
    const int first = state_.iteration;
    for (;;) {
      poll();
      const auto start = std::chrono::steady_clock::now();
      const Evaluation now = problem_.evaluate(
          state_.theta, target_, static_cast<std::uint32_t>(state_.iteration), [this] { poll(); });
      last_ = {state_.iteration,    state_.seconds + seconds_since(start),         now.loss,
               std::sqrt(now.loss), distance_to_target(parameters_, state_.theta), norm(now.gradient)};
      if (state_.iteration == 0) {
        write_exr(path("initial.exr"), now.image);
        state_.loss_initial = last_.loss;
        state_.image_rmse_initial = last_.image_rmse;
        state_.param_rmse_initial = last_.param_rmse;
      }
      log.append(last_, state_.theta);
      report(first, seconds_since(call_start));

      const bool finite = std::isfinite(last_.loss) && std::isfinite(last_.gradient_norm);
      const bool converged = optimizer.tolerance > 0 && last_.image_rmse <= converged_rmse;
      const bool gave_up = state_.rejected_in_row >= kMostRejectedInRow;
      if (converged || gave_up || state_.iteration >= optimizer.iterations) {
        write_exr(path("final.exr"), now.image);
        if (converged) return RunStatus::converged;
        const bool worse = last_.loss > kDivergedLossRatio * state_.loss_initial;
        return gave_up || worse || !finite ? RunStatus::diverged : RunStatus::iterations_reached;
      }
      step(now.gradient, finite);
      state_.seconds += seconds_since(start);
      save_checkpoint(options_.folder, state_, parameters_);
    }
  }

  void step(const std::vector<double>& gradient, bool finite) {
    if (finite) {
      const AdamOptions adam{.learning_rate = problem_.experiment().optimizer.learning_rate};
      adam_step(adam, gradient, parameters_.lower(), parameters_.upper(), state_.adam, state_.theta);
      state_.rejected_in_row = 0;
    } else {
      ++state_.rejected;
      ++state_.rejected_in_row;
      if (options_.warning)
        options_.warning(
            fmt::format("iteration {}: loss or gradient is not finite, step rejected", state_.iteration));
    }
    ++state_.iteration;
  }

  void report(int first, double seconds) const {
    if (!options_.progress) return;
    const int iterations = problem_.experiment().optimizer.iterations;
    const double each = seconds / (state_.iteration - first + 1);
    options_.progress({state_.iteration, iterations, last_.loss, last_.param_rmse, each,
                       each * (iterations - state_.iteration)});
  }

  void write_summary(RunStatus status) const {
    std::string text =
        fmt::format("status: {}\niterations: {}\nseconds: {}\nrejected_steps: {}\n", name(status),
                    state_.iteration, std::max(state_.seconds, last_.seconds), state_.rejected);
    auto out = std::back_inserter(text);
    const auto pair = [&](const char* key, double initial, double final) {
      fmt::format_to(out, "{0}_initial: {1}\n{0}_final: {2}\n", key, optional_number(initial),
                     optional_number(final));
    };
    pair("loss", state_.loss_initial, last_.loss);
    pair("image_rmse", state_.image_rmse_initial, last_.image_rmse);
    pair("param_rmse", state_.param_rmse_initial, last_.param_rmse);
    text += "parameters:\n";
    for (const Parameters::Block& block : parameters_.blocks()) {
      const auto begin = state_.theta.begin() + block.begin;
      if (block.count == 1)
        fmt::format_to(out, "  {}: {}\n", block.name, *begin);
      else
        fmt::format_to(out, "  {}: [{}]\n", block.name, fmt::join(begin, begin + block.count, ", "));
    }
    write_file_atomically(path("summary.yaml"), text);
  }

  const Problem& problem_;
  const Parameters& parameters_;
  const RunOptions& options_;
  Checkpoint state_;
  GatedImage target_;
  LogRow last_;
};

}  // namespace

const char* name(RunStatus status) {
  switch (status) {
    case RunStatus::converged:
      return "converged";
    case RunStatus::iterations_reached:
      return "iterations_reached";
    case RunStatus::diverged:
      return "diverged";
    case RunStatus::interrupted:
      return "interrupted";
  }
  throw std::logic_error("unknown status");
}

RunStatus start_run(const Experiment& experiment, const RunOptions& options) {
  const Problem problem(experiment);
  problem.require_parameters();
  make_output_folder(options.folder);
  if (std::filesystem::exists(options.folder + "/experiment.yaml")) {
    if (options.force) {
      clear_run(options.folder);
    } else {
      const std::string kept = set_aside(options.folder);
      if (options.warning) options.warning(fmt::format("{} held a run already: moved to {}", options.folder, kept));
      make_output_folder(options.folder);
    }
  }
  const std::string file = options.folder + "/experiment.yaml";
  const std::string resolved = resolved_yaml(experiment, options.folder);
  write_file_atomically(file, resolved);
  return Run(problem, options).execute();
}

RunStatus resume_run(const RunOptions& options) {
  const std::string file = options.folder + "/experiment.yaml";
  if (!std::filesystem::exists(file))
    throw InputError(fmt::format("{}: holds no run to resume (there is no experiment.yaml)", options.folder));
  const Problem problem(load_experiment(file));
  problem.require_parameters();
  make_output_folder(options.folder);
  return Run(problem, options).execute();
}

}  // namespace isochron
