#pragma once
#include <functional>
#include <optional>
#include <string>

#include "app/options.h"
#include "optim/run/run.h"

namespace isochron {

/// What run, resume and reconstruct share: progress, interruption, plots, the closing message and the exit status. Empty where
/// there is nothing to run.
std::optional<int> execute_run(const std::string& folder, const CommonOptions& common,
                               const std::function<std::optional<RunStatus>(const RunOptions&)>& start);

}  // namespace isochron
