#include "optim/problem/dark_bins.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace isochron {
namespace {

/// What a Poisson number of this mean exceeds once in a thousand times (Cornish and Fisher's expansion of its quantile).
double rarely_exceeded(double mean) {
  constexpr double kNormal = 3.0902;  // of 1 - 1/1000
  return mean + kNormal * std::sqrt(mean) + (kNormal * kNormal - 1) / 6;
}

double dark_level(std::vector<double> counts) {
  if (counts.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(counts.begin(), counts.end());
  std::vector<double> sums{0};
  for (const double n : counts) sums.push_back(sums.back() + n);
  // Fewer bins stay each time, so that this ends; the darkest one is never above a mean of bins that it is one of.
  for (std::size_t kept = counts.size();;) {
    const double mean = sums[kept] / static_cast<double>(kept);
    const auto end = counts.begin() + static_cast<std::ptrdiff_t>(kept);
    const auto dark =
        static_cast<std::size_t>(std::upper_bound(counts.begin(), end, rarely_exceeded(mean)) - counts.begin());
    if (dark == kept) return mean;
    kept = dark;
  }
}

/// The bound of component i, which files give once for all or for each.
double bound(const std::vector<double>& values, std::size_t i, double missing) {
  return values.empty() ? missing : values.size() == 1 ? values[0] : values[std::min(i, values.size() - 1)];
}

}  // namespace

std::vector<double> dark_levels(const GatedImage& counts, const Readings& readings, int sets) {
  std::vector<double> levels;
  for (int set = 0; set < sets; ++set) {
    std::vector<double> own;
    for (int pixel = set; pixel < counts.pixels(); pixel += sets)
      for_each_reading(counts, readings, pixel, [&](std::size_t i) { own.push_back(counts.data[i]); });
    levels.push_back(dark_level(std::move(own)));
  }
  return levels;
}

void begin_at_dark_bins(std::vector<ParameterSpec>& parameters, const GatedImage* counts, const Readings& readings,
                        int sensor_points) {
  for (ParameterSpec& spec : parameters) {
    if (spec.type != ParameterType::background || spec.initial.size() > 1) continue;
    const bool per_point = spec.per == Per::pixel;
    if (!spec.initial.empty() && (!per_point || !counts)) continue;
    if (!counts) spec.fail("initial", "is missing", "a number: only a measurement's counts have dark bins");
    std::vector<double> levels = dark_levels(*counts, readings, per_point ? sensor_points : 1);
    for (std::size_t i = 0; i < levels.size(); ++i) {
      if (std::isnan(levels[i])) levels[i] = spec.initial.empty() ? 0 : spec.initial[0];
      levels[i] = std::max(levels[i], bound(spec.lower, i, 0));
      levels[i] = std::min(levels[i], bound(spec.upper, i, std::numeric_limits<double>::infinity()));
    }
    spec.initial = std::move(levels);
  }
}

}  // namespace isochron
