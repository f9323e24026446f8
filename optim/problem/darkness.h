// Gates that see no light: nearly always centres in another unit than the scene's, or lamps that face away.
#pragma once
#include <string>
#include <vector>

#include "core/image/image.h"
#include "optim/problem/problem.h"

namespace isochron {

/// One line that names the gates of an image at theta that no light reaches, where they are, and how long the scene's paths are,
/// in the experiment's unit; empty where there is none. `what`: such as "the target". Background is no light. The first bins of a
/// histogram are often dark: of bins it tells only where all are.
std::string darkness_warning(const Problem& problem, const std::vector<double>& theta, const GatedImage& image,
                             const std::string& what);
/// The same by an image's averages over pixels and channels.
std::string darkness_warning(const Problem& problem, const std::vector<double>& theta, const std::vector<double>& means,
                             const std::string& what);

/// The same of a residual: gates that are dark in both, or one of the two images where it is dark as a whole. That a gate
/// is dark in one of them alone can be what an optimisation is about.
std::string darkness_warning(const Problem& problem, const std::vector<double>& theta, const GatedImage& image,
                             const GatedImage& target);

}  // namespace isochron
