#pragma once
#include <string>

#include "optim/run/log.h"
#include "optim/run/loop.h"

namespace isochron {

/// Text of summary.yaml. `last`: the last row, that of the final parameters unless the run was interrupted;
/// `state` holds those parameters. Unknown numbers are null. `noise_share` is that of
/// loss_spread().
std::string summary_yaml(const LoopResult& result, const Checkpoint& state, const LogRow& last,
                         const Parameters& parameters);

}  // namespace isochron
