// What tables say about a gate beside its number.
#pragma once
#include <string>

#include "optim/problem/problem.h"

namespace isochron {

/// Names of the columns, to follow those of the contract: `,gate_center` (path length, scene units) and, where the
/// experiment gives gates as times, `,gate_center_ns` or `,gate_center_ps`; of modulated gates `,gate_center_degrees`, the phase.
std::string gate_column_names(const GateSpec& spec);

/// Their values for one gate, each after a comma; nan of the steady sensor, which has no centre.
std::string gate_column_values(const Problem& problem, int gate);

/// The same for people: `5.5`, `18.3 ns` or `90 degrees`; `all` of the steady sensor.
std::string gate_label(const Problem& problem, int gate);

}  // namespace isochron
