#pragma once
#include <functional>
#include <string>

#include "app/options.h"
#include "optim/run/run.h"

namespace isochron {

/// What run and resume share: progress, interruption, plots, the closing message and the exit status.
int execute_run(const std::string& folder, const CommonOptions& common, bool force,
                const std::function<RunStatus(const RunOptions&)>& start);

}  // namespace isochron
