// What the commands have in common: options, reading the experiment, the output folder.
#pragma once
#include <CLI/CLI.hpp>
#include <cstdint>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "app/experiment_source.h"
#include "optim/experiment/experiment.h"
#include "optim/problem/problem.h"

namespace isochron {

/// What main does once the command line is parsed; returns the exit status.
using Action = std::function<int()>;

/// `file` is the experiment, or for resume the folder.
struct CommonOptions : ExperimentSource {
  std::string output;  ///< empty: runs/NAME of run, runs/NAME-COMMAND of others
  std::string at;      ///< empty: initial
  int threads = 0;     ///< 0: all cores
  bool quiet = false;
  bool no_plots = false;
  std::string parameter;  ///< of derive and check; empty: all
  bool force = false;     ///< of run and reconstruct
};

/// Options of every command.
void add_session_options(CLI::App& command, CommonOptions& options);
/// Those, and what the commands that read an experiment share.
void add_experiment_options(CLI::App& command, CommonOptions& options);

/// Applies threads and verbosity. To be called first by every action.
void begin_session(const CommonOptions& options);

/// Shows a warning of one line.
void warn(const std::string& text);

/// --parameter, of the commands that can be restricted to one parameter.
void add_parameter_option(CLI::App& command, CommonOptions& options);
/// --force, of those that may replace a run.
void add_force_option(CLI::App& command, CommonOptions& options);
/// Checks of options' values, which CLI11's own let pass: what is no number, is infinite, or does not fit.
CLI::Validator whole_number(std::int64_t low, std::int64_t high);
CLI::Validator number(double low, double high);
CLI::Validator positive_number();

/// --seed: a number that experiments may have.
template <class Seed>
void add_seed_option(CLI::App& command, Seed& seed) {
  command.add_option("--seed", seed, "seed of the random numbers")
      ->check(whole_number(0, std::numeric_limits<std::int64_t>::max()))
      ->type_name("N");
}
/// Unknowns [begin, begin + count) that --parameter names; all for an empty name. Throws InputError.
Parameters::Block chosen_parameter(const Parameters& parameters, const std::string& name);

/// Names the files that a command wrote into its folder; of more than a few only the first and the last.
void say_written(const std::string& folder, const std::vector<std::string>& files);

/// Number of threads that renderers use.
int thread_count(const CommonOptions& options);

}  // namespace isochron
