#pragma once
#include <string>
#include <vector>

namespace isochron {

/// The logs of a run's levels (see log.h) as one, with a column `level` at the end. Iterations and seconds count on from level to
/// level. Columns are those of the last one; what another level has not, as it writes norms or single values, stays empty there.
std::string joined_logs(const std::vector<std::string>& logs);

}  // namespace isochron
