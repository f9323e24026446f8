// Unknowns that ended at a bound: what stands there is the bound's value, not one that the data chose.
#pragma once
#include <string>
#include <vector>

#include "optim/problem/parameters.h"
#include "optim/problem/standard_errors.h"

namespace isochron {

/// Those of one parameter at one kind of bound.
struct AtBound {
  std::string name;
  bool upper = false;
  double bound = 0;        ///< of the first of them, in units of the parameter
  int count = 0, of = 0;   ///< how many are there, of how many
  std::vector<int> first;  ///< indices within the parameter, rising; 10 at most
};

/// Whether unknown i lies on its lower or upper bound. A mean of values that all did counts, though it may have been rounded off it.
bool is_at_bound(const Parameters& parameters, const std::vector<double>& theta, std::size_t i);

/// In the order of the parameters, lower bounds first. Without unknowns whose bounds are within 0.25 % of each other: these were chosen, and
/// are no surprise.
std::vector<AtBound> find_at_bounds(const Parameters& parameters, const std::vector<double>& theta);

/// Drops from `errors.steps_left` the steps that bounds cut to no more than the standard error: what they hold is at the minimum that they allow.
void drop_held_steps(const Parameters& parameters, const std::vector<double>& theta, ParameterErrors& errors);

/// A line for each, indented by two blanks: `gain ended at its lower bound 0.01`.
std::string bounds_report(const std::vector<AtBound>& found);

/// The key `at_bounds` of summary.yaml: `at_bounds: {}` where there are none.
std::string bounds_yaml(const std::vector<AtBound>& found);

}  // namespace isochron
