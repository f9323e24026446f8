#include "optim/problem/eliminated_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

using Vector = std::vector<double>;

/// A solution x of (H + P) x = w.
struct Solved {
  Vector solution;
  double along, curved;  ///< w'x, and x'(H + P)x with H from other random numbers

  double variance() const { return curved > 0 ? along * along / curved : std::numeric_limits<double>::infinity(); }
  /// Both are the same but for noise, which the solution has followed where they differ by more than a factor of two.
  bool is_noise() const { return !(curved > along / 2 && curved < 2 * along); }
};

std::vector<Solved> solve_and_check(const CurvatureProducts& curvature, const VectorList& weights,
                                    const ApproximateInverse& precondition, double least_curvature) {
  VectorList solutions = solve([&](const VectorList& vectors) { return curvature.products(vectors); }, weights,
                               precondition, {.least_curvature = least_curvature});
  const Curvatures within = curvature.within(solutions);
  std::vector<Solved> solved;
  for (std::size_t k = 0; k < weights.size(); ++k) {
    const std::size_t entry = k * weights.size() + k;
    const double along = dot(weights[k], solutions[k]);
    solved.push_back({std::move(solutions[k]), along, within.data[entry] + within.prior[entry]});
  }
  return solved;
}

}  // namespace

ParameterErrors eliminated_errors(const CurvatureProducts& curvature, const std::vector<double>& diagonal,
                                  const std::vector<double>& smoothed,
                                  const std::vector<std::vector<double>>& gradients, const NoiseLevel& noise,
                                  const std::vector<Parameters::Block>& blocks, const std::vector<std::string>& names,
                                  const std::vector<double>& theta) {
  const std::size_t n = theta.size();
  const std::vector<ParameterChange> changes = parameter_changes(blocks, theta);
  std::vector<Vector> columns;
  for (const ParameterChange& change : changes) columns.push_back(change.values);
  std::vector<bool> unseen(n), kept(n), asked(n);
  Vector least(n);
  for (std::size_t i = 0; i < n; ++i) {
    unseen[i] = !(diagonal[i] - smoothed[i] > kRoundOff * diagonal[i]);
    kept[i] = smoothed[i] > 0;
    least[i] = std::sqrt(noise.scale / diagonal[i]);
  }
  for (const Parameters::Block& block : blocks)
    std::fill_n(asked.begin() + block.begin, block.count, block.count <= kFewComponents);
  const Determined determined(blocks, names, theta, curvature.within(columns).bound, changes, unseen, kept);

  const auto spreads = [&](const std::vector<Vector>& weights) {
    std::vector<Spread> result;
    if (weights.empty()) return result;
    std::vector<std::size_t> free;
    for (std::size_t i = 0; i < n; ++i)
      if (!determined.fixed()[i] && diagonal[i] > 0) free.push_back(i);
    const ApproximateInverse precondition = curvature.preconditioner(std::move(free));
    for (Solved& found : solve_and_check(curvature, weights, precondition, 0)) {
      if (found.is_noise())
        found = std::move(solve_and_check(curvature, {weights[result.size()]}, precondition, kAboveNoise)[0]);
      result.push_back({found.variance(), {}});
      for (const Vector& gradient : gradients) result.back().steps.push_back(-dot(gradient, found.solution));
    }
    return result;
  };
  ParameterErrors errors = determined.errors(noise, asked, least, spreads);
  errors.from = "gauss_newton_products";
  return errors;
}

}  // namespace isochron
