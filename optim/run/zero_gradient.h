#pragma once
#include <string>
#include <vector>

#include "optim/problem/parameters.h"

namespace isochron {

/// A line for the screen, indented by two blanks, for each parameter whose gradient is exactly zero, or that of some of its
/// unknowns: nothing that was rendered depends on them there, so that they stay where they are.
std::string zero_gradient_report(const Parameters& parameters, const std::vector<double>& gradient);

}  // namespace isochron
