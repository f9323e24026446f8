#include "optim/run/bounds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace isochron {
namespace {

bool reaches(double value, double bound, bool upper) {
  constexpr double kRounding = 1e-12;  // of a mean over some hundred rows, relative to the bound
  const double beyond = upper ? value - bound : bound - value;
  return std::isfinite(bound) && beyond >= -kRounding * std::abs(bound);
}

/// Whether bounds hold the unknown to a 400th of itself: whoever sets such ones has chosen the value. That of the gain of reconstructions is a 500th.
bool hold(double lower, double upper) {
  constexpr double kRoom = 0.0025;
  return std::isfinite(upper - lower) && upper - lower <= kRoom * std::max(std::abs(lower), std::abs(upper));
}

}  // namespace

bool is_at_bound(const Parameters& parameters, const std::vector<double>& theta, std::size_t i) {
  return reaches(theta[i], parameters.lower()[i], false) || reaches(theta[i], parameters.upper()[i], true);
}

std::vector<AtBound> find_at_bounds(const Parameters& parameters, const std::vector<double>& theta) {
  constexpr std::size_t kMostIndices = 10;
  std::vector<AtBound> found;
  for (const Parameters::Block& block : parameters.blocks())
    for (const bool upper : {false, true}) {
      AtBound at{block.name, upper, 0, 0, block.count, {}};
      for (int i = 0; i < block.count; ++i) {
        const std::size_t index = block.begin + i;
        const double bound = (upper ? parameters.upper() : parameters.lower())[index];
        if (hold(parameters.lower()[index], parameters.upper()[index])) continue;
        if (!reaches(theta[index], bound, upper)) continue;
        if (at.count++ == 0) at.bound = bound;
        if (at.first.size() < kMostIndices) at.first.push_back(i);
      }
      if (at.count > 0) found.push_back(std::move(at));
    }
  return found;
}

void drop_held_steps(const Parameters& parameters, const std::vector<double>& theta, ParameterErrors& errors) {
  const std::vector<std::string>& names = parameters.component_names();
  std::erase_if(errors.steps_left, [&](const auto& left) {
    const auto& [name, step] = left;
    const std::size_t i = std::find(names.begin(), names.end(), name) - names.begin();
    const double reached = std::clamp(theta[i] + step, parameters.lower()[i], parameters.upper()[i]);
    return std::abs(reached - theta[i]) <= errors.values[i];
  });
}

std::string bounds_report(const std::vector<AtBound>& found) {
  std::string text;
  for (const AtBound& at : found) {
    const char* kind = at.upper ? "upper" : "lower";
    text += at.of == 1 ? fmt::format("  {} ended at its {} bound {:.5g}\n", at.name, kind, at.bound)
                       : fmt::format("  {}: {} of {} ended at their {} bound {:.5g} ({}{})\n", at.name, at.count, at.of,
                                     kind, at.bound, fmt::join(at.first, ", "),
                                     at.count > static_cast<int>(at.first.size()) ? ", ..." : "");
  }
  return text;
}

std::string bounds_yaml(const std::vector<AtBound>& found) {
  if (found.empty()) return "at_bounds: {}\n";
  std::string text = "at_bounds:\n";
  std::string name;
  for (const AtBound& at : found) {
    if (at.name != name) fmt::format_to(std::back_inserter(text), "  {}:\n", at.name);
    name = at.name;
    fmt::format_to(std::back_inserter(text), "    {}: {{bound: {}, count: {}, first: [{}]}}\n",
                   at.upper ? "upper" : "lower", at.bound, at.count, fmt::join(at.first, ", "));
  }
  return text;
}

}  // namespace isochron
