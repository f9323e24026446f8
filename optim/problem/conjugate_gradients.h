// Linear systems of a matrix of which only products are available.
#pragma once
#include <functional>
#include <vector>

namespace isochron {

/// When a system counts as solved: once the last four steps add less than `least_gain` to x'b, but after `most_steps` in any case.
struct SolutionLimits {
  int most_steps = 24;
  double least_gain = 0.05;
  /// An equation ends, too, at a direction whose curvature is below this part of what the preconditioner expects.
  double least_curvature = 0;
};

/// SolutionLimits::least_curvature for noisy products. Where nothing changes the readings, as motion within a surface does not, the noise is
/// all there is, of either sign; what preconditions has it squared. Two plates that are off by 0.4 mm in the median had stated errors of 0.6 m
/// without this limit, of 1.1 mm with it; a blob whose curvatures are above has the same errors with and without.
inline constexpr double kAboveNoise = 0.1;

using VectorList = std::vector<std::vector<double>>;

/// Of a matrix; symmetric.
using ApproximateInverse = std::function<std::vector<double>(const std::vector<double>&)>;

/// Solutions x of A x = b for several right-hand sides at once, by conjugate gradients: x'b grows from step to step, up to that
/// of the solution. `products`: A times each of some vectors; A symmetric, and where noise makes it indefinite an equation
/// ends early. Unknowns for which `precondition` gives 0 stay 0.
VectorList solve(const std::function<VectorList(const VectorList&)>& products, const VectorList& right_sides,
                 const ApproximateInverse& precondition, const SolutionLimits& limits = {});

}  // namespace isochron
