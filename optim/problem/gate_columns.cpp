#include "optim/problem/gate_columns.h"

#include <fmt/format.h>

namespace isochron {
std::string gate_column_names(const GateSpec& spec) {
  return spec.unit == LengthUnit::scene ? ",gate_center" : fmt::format(",gate_center,gate_center_{}", name(spec.unit));
}

std::string gate_column_values(const Problem& problem, int gate) {
  const GateSpec& spec = problem.experiment().gates;
  const bool steady = problem.gates().shape().is_steady();
  std::string text = steady ? ",nan" : fmt::format(",{}", problem.gates().center(gate));
  if (spec.unit != LengthUnit::scene) text += steady ? ",nan" : fmt::format(",{}", spec.centers[gate]);
  return text;
}

std::string gate_label(const Problem& problem, int gate) {
  if (problem.gates().shape().is_steady()) return "all";
  const GateSpec& spec = problem.experiment().gates;
  if (spec.unit == LengthUnit::scene) return fmt::format("{:.5g}", problem.gates().center(gate));
  return fmt::format("{:.5g} {}", spec.centers[gate], name(spec.unit));
}

}  // namespace isochron
