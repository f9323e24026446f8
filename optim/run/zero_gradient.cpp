#include "optim/run/zero_gradient.h"

#include <fmt/format.h>

#include <algorithm>

namespace isochron {

std::string zero_gradient_report(const Parameters& parameters, const std::vector<double>& gradient) {
  std::string text;
  for (const Parameters::Block& block : parameters.blocks()) {
    const auto begin = gradient.begin() + block.begin;
    const auto zeros = std::count(begin, begin + block.count, 0.0);
    if (zeros == 0) continue;
    const std::string some = zeros == block.count ? "" : fmt::format(" of {} of its {} unknowns", zeros, block.count);
    text += fmt::format("  {}: the gradient{} is exactly zero: nothing that was rendered depends on it\n", block.name,
                        some);
  }
  return text;
}

}  // namespace isochron
