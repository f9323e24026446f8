// The optimisers on one experiment: error of the parameters against CPU time.
#pragma once
#include <functional>
#include <string>
#include <vector>

#include "core/image/image.h"
#include "optim/problem/problem.h"

namespace isochron {

struct RaceOptions {
  double core_seconds = 120;  ///< for all runs together, about; a run ends after the iteration that uses up its share
  int seeds = 3;              ///< runs of each method: the experiment's seed and those after it
  double error = 0.01;        ///< relative to the error at the start, that the table asks for
  std::function<void(const std::string&)> progress;  ///< one line
};

struct RacePoint {
  int iteration = 0;
  double core_seconds = 0;  ///< until the parameters were there
  double error = 0;         ///< their RMS error, relative to that at the start
};

struct RaceRun {
  std::string method;
  std::uint64_t seed = 0;
  std::vector<RacePoint> points;  ///< the start first
};

struct Race {
  double error = 0;
  std::vector<RaceRun> runs;  ///< method by method
  std::vector<std::string> notes;
};

/// Throws InputError where target values are unknown or those of the start: no error to follow.
void require_error(const Problem& problem);

/// Every optimiser (lbfgs with half of learning_rate as its first trial step, diffusion only with adam), all else as the
/// experiment says. A method that would not fit into memory is left out with a note. Of a problem that passed
/// require_error.
Race race_solvers(const Experiment& experiment, const GatedImage& target, const RaceOptions& options);

/// The first point from which on the error stays at or below `error`, or -1.
int arrival(const RaceRun& run, double error);

/// `method,seed,iteration,core_seconds,error`
std::string race_csv(const Race& race);
/// Runs that arrive, their median time, and errors at the end.
std::string race_table(const Race& race);

}  // namespace isochron
