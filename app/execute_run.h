#pragma once
#include <functional>
#include <optional>
#include <string>

#include "app/options.h"
#include "optim/run/run.h"

namespace isochron {

/// What run and resume share: progress, interruption, plots, the closing message and the exit status.
int execute_run(const std::string& folder, const CommonOptions& common, bool force,
                const std::function<RunStatus(const RunOptions&)>& start);

/// The same where there may be nothing to run; empty then.
std::optional<int> execute_run_if_any(const std::string& folder, const CommonOptions& common, bool force,
                                      const std::function<std::optional<RunStatus>(const RunOptions&)>& start);

}  // namespace isochron
