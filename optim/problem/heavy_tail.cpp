#include "optim/problem/heavy_tail.h"

#include <fmt/format.h>

#include <algorithm>

namespace isochron {
namespace {

constexpr std::size_t kMostNamed = 4;  ///< parameters in one warning

/// "gate 3", "gates 0-2, 5"
std::string show_gates(std::vector<int> gates) {
  std::sort(gates.begin(), gates.end());
  gates.erase(std::unique(gates.begin(), gates.end()), gates.end());
  std::string text = gates.size() == 1 ? "gate " : "gates ";
  for (std::size_t i = 0, last = 0; i < gates.size(); i = last + 1) {
    last = i;
    while (last + 1 < gates.size() && gates[last + 1] == gates[last] + 1) ++last;
    text += fmt::format("{}{}", i ? ", " : "", gates[i]);
    if (last > i) text += fmt::format("-{}", gates[last]);
  }
  return text;
}

}  // namespace

void HeavyTails::add(const std::string& parameter, int gate, double effective_count) {
  if (!(effective_count < kFewestDeviations)) return;
  smallest_ = entries_.empty() ? effective_count : std::min(smallest_, effective_count);
  if (entries_.empty() || entries_.back().parameter != parameter) entries_.push_back({parameter, {}});
  if (gate >= 0) entries_.back().gates.push_back(gate);
}

std::string HeavyTails::warning() const {
  if (entries_.empty()) return {};
  std::string names;
  for (std::size_t i = 0; i < std::min(entries_.size(), kMostNamed); ++i) {
    names += (i ? ", " : "") + entries_[i].parameter;
    if (!entries_[i].gates.empty()) names += " (" + show_gates(entries_[i].gates) + ")";
  }
  if (entries_.size() > kMostNamed) names += fmt::format(" and {} more", entries_.size() - kMostNamed);
  return fmt::format(
      "heavy tail in {}: a few rare samples make nearly all of the noise (in effect {:.1f}), so the true error may be "
      "far larger than the standard error; take many more samples or wider gates",
      names, smallest_);
}

}  // namespace isochron
