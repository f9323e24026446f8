#include "optim/problem/standard_errors.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <limits>

namespace isochron {

double variance_scale(const Problem& problem, const Evaluation& at) {
  const double readings = problem.readings().count(at.image);
  if (problem.experiment().loss.kind == LossKind::poisson) return 1 / readings;
  return at.mean_squared_error > 0 ? 2 * at.mean_squared_error / readings : std::numeric_limits<double>::quiet_NaN();
}

std::vector<double> standard_errors(const std::vector<double>& matrix, double scale) {
  constexpr Eigen::Index kMostUnknowns = 1000;
  const auto n = static_cast<Eigen::Index>(std::lround(std::sqrt(static_cast<double>(matrix.size()))));
  if (n == 0 || n > kMostUnknowns || !std::isfinite(scale)) return {};
  const Eigen::Map<const Eigen::MatrixXd> h(matrix.data(), n, n);
  // Scaled to a unit diagonal: unknowns have units.
  const Eigen::VectorXd root = h.diagonal().cwiseSqrt().cwiseInverse();
  if (!root.allFinite()) return {};
  const Eigen::LLT<Eigen::MatrixXd> factor(root.asDiagonal() * h * root.asDiagonal());
  if (factor.info() != Eigen::Success) return {};
  const Eigen::VectorXd inverse = factor.solve(Eigen::MatrixXd::Identity(n, n)).diagonal();
  std::vector<double> errors(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) errors[static_cast<std::size_t>(i)] = std::sqrt(scale * inverse[i]) * root[i];
  return errors;
}

std::vector<double> least_standard_errors(const std::vector<double>& diagonal, double scale) {
  if (!std::isfinite(scale)) return {};
  std::vector<double> errors;
  for (const double d : diagonal) errors.push_back(std::sqrt(scale / d));
  return errors;
}

}  // namespace isochron
