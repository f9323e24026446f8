#include "optim/problem/eliminated_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/conjugate_gradients.h"
#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

using Vector = std::vector<double>;

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
    Vector inverse_diagonal(n);
    for (std::size_t i = 0; i < n; ++i)
      if (!determined.fixed()[i]) inverse_diagonal[i] = 1 / diagonal[i];
    std::vector<Spread> result;
    if (weights.empty()) return result;
    const auto products = [&](const VectorList& vectors) { return curvature.products(vectors); };
    const auto precondition = [&](Vector values) {
      for (std::size_t i = 0; i < n; ++i) values[i] *= inverse_diagonal[i];
      return values;
    };
    const VectorList solutions = solve(products, weights, precondition);
    const Curvatures within = curvature.within(solutions);
    for (std::size_t k = 0; k < weights.size(); ++k) {
      const std::size_t entry = k * weights.size() + k;
      const double curved = within.data[entry] + within.prior[entry], along = dot(weights[k], solutions[k]);
      result.push_back({curved > 0 ? along * along / curved : std::numeric_limits<double>::infinity(), {}});
      for (const Vector& gradient : gradients) result.back().steps.push_back(-dot(gradient, solutions[k]));
    }
    return result;
  };
  ParameterErrors errors = determined.errors(noise, asked, least, spreads);
  errors.from = "gauss_newton_products";
  return errors;
}

}  // namespace isochron
