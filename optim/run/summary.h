#pragma once
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "optim/problem/goodness_of_fit.h"
#include "optim/problem/standard_errors.h"
#include "optim/run/log.h"
#include "optim/run/loop.h"

namespace isochron {

/// What the last call of a run took: since it began or was resumed.
struct RunCost {
  int first_iteration = 0;    ///< the one that it began with
  double seconds = 0;         ///< target and closing images included
  long long rays = 0;         ///< of all passes
  long long peak_memory = 0;  ///< of the process, bytes
  /// Seconds by what they were for, in the order in which they are written.
  std::vector<std::pair<std::string, double>> passes = {};
};

/// Text of summary.yaml. `last`: the last row, that of the final parameters unless the run was interrupted;
/// `state` holds those parameters. Unknown numbers are null. `noise_share` is that of
/// loss_spread().
std::string summary_yaml(const LoopResult& result, const Checkpoint& state, const LogRow& last,
                         const Parameters& parameters, const RunCost& cost = {}, const ParameterErrors& errors = {},
                         const std::optional<GoodnessOfFit>& fit = {});

/// Whether the run of a summary.yaml has come to its end: there is one, and the run was not interrupted.
bool has_ended(const std::string& file);

/// Values of all unknowns, as summary.yaml has them. Throws InputError where it is of other parameters.
std::vector<double> final_values(const std::string& file, const Parameters& parameters);

}  // namespace isochron
