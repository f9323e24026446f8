#include "optim/problem/gate_columns.h"

#include <fmt/format.h>

namespace isochron {
namespace {

/// Whether people know gates by something else than the centre in scene units.
bool marked_otherwise(const GateMarks& marks) {
  return marks.unit != name(LengthUnit::scene);
}

}  // namespace

std::string gate_column_names(const GateSpec& spec) {
  const GateMarks marks = gate_marks(spec);
  return marked_otherwise(marks) ? fmt::format(",gate_center,gate_center_{}", marks.unit) : ",gate_center";
}

std::string gate_column_values(const Problem& problem, int gate) {
  const GateMarks marks = gate_marks(problem.experiment().gates);
  const bool steady = marks.numbers.empty();
  std::string text = steady ? ",nan" : fmt::format(",{}", problem.gates().center(gate));
  if (marked_otherwise(marks)) text += steady ? ",nan" : fmt::format(",{}", marks.numbers[gate]);
  return text;
}

std::string gate_label(const Problem& problem, int gate) {
  const GateMarks marks = gate_marks(problem.experiment().gates);
  if (marks.numbers.empty()) return "all";
  if (!marked_otherwise(marks)) return fmt::format("{:.5g}", problem.gates().center(gate));
  return fmt::format("{:.5g} {}", marks.numbers[gate], marks.unit);
}

}  // namespace isochron
