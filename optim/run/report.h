// What a run found, as text for the screen.
#pragma once
#include <optional>
#include <string>

#include "optim/experiment/experiment.h"
#include "optim/problem/goodness_of_fit.h"
#include "optim/problem/standard_errors.h"
#include "optim/run/log.h"
#include "optim/run/loop.h"

namespace isochron {

/// A table of the parameters and lines about loss and noise, each ended by a newline. `last` and `state` as in
/// summary_yaml. A parameter with at most 3 components has a row for each; one with more has one row, with root mean
/// squares over its components in all columns. Of the errors: what is
/// undetermined, what is determined together, and what would still move. Targets and errors that are unknown are left out.
std::string run_report(const LoopResult& result, const Checkpoint& state, const LogRow& last,
                       const Parameters& parameters, const ParameterErrors& errors = {},
                       const std::optional<GoodnessOfFit>& fit = {});

/// Lines that name what a run's folder holds: results, meshes, pictures where `plots` says that they have been drawn, and what
/// a resumption needs.
std::string files_to_look_at(const std::string& folder, bool plots);

}  // namespace isochron
