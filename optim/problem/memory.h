// Memory is estimated before it is taken: a system that promises what it does not have kills the process without a word.
#pragma once
#include <string>
#include <vector>

#include "optim/problem/problem.h"

namespace isochron {

/// What the process may still take, in bytes: the least of the system's available memory, its control group's and its
/// limits of address space and data (ulimit); infinite where nothing is known.
double available_memory();

/// A part of what a command needs.
struct MemoryUse {
  std::string what;
  double bytes = 0;
};

/// Of gated images at the experiment's resolution, with their errors, and written as EXR.
std::vector<MemoryUse> image_memory(const Problem& problem);
/// The same of derivative images of `columns` unknowns at a time.
std::vector<MemoryUse> derivative_memory(const Problem& problem, int columns);
/// Of finite differences, `images` of which are kept.
std::vector<MemoryUse> difference_memory(const Problem& problem, int images);
/// Of an optimisation by the experiment's method, the target included.
std::vector<MemoryUse> run_memory(const Problem& problem);

/// Throws InputError, one line that names the parts and what to lower, when they add up to more than `available` bytes.
void require_memory(const Problem& problem, const std::vector<MemoryUse>& parts, double available = available_memory());
/// The same of one part that is about to be made; `advice`: what to lower.
void require_memory(const MemoryUse& part, const std::string& advice, double available = available_memory());

}  // namespace isochron
