#include "optim/solvers/quadratic_model.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace isochron {

double max_expected_decrease(const Evaluation& at) {
  const double error = std::isfinite(at.loss_noise) ? 2 * at.loss_noise : 0;
  return std::max(0.0, at.loss) + error;
}

QuadraticModel quadratic_model(const Evaluation& at) {
  using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
  constexpr double kLeastRatio = 1e-9;  // of eigenvalues: what round-off leaves of a singular matrix
  const auto n = static_cast<Eigen::Index>(at.gradient.size());
  const Eigen::Map<const Eigen::VectorXd> gradient(at.gradient.data(), n);
  const Eigen::Map<const Matrix> unbiased(at.curvature.data(), n, n), bound(at.curvature_bound.data(), n, n);

  // Unknowns that nothing depends on have no curvature and no gradient: any scale will do.
  Eigen::VectorXd width = bound.diagonal().cwiseMax(0.0).cwiseSqrt();
  for (Eigen::Index i = 0; i < n; ++i)
    if (!(width[i] > 0)) width[i] = 1;
  const Eigen::MatrixXd relative = width.cwiseInverse().asDiagonal() * unbiased * width.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(relative);
  Eigen::VectorXd values = eigen.eigenvalues();  // in rising order
  const double largest = std::max(-values[0], values[n - 1]);
  const double least = largest > 0 ? std::max(-values[0], kLeastRatio * largest) : 1;
  values = values.cwiseMax(least);
  Eigen::MatrixXd curvature = width.asDiagonal() *
                              (eigen.eigenvectors() * values.asDiagonal() * eigen.eigenvectors().transpose()) *
                              width.asDiagonal();

  QuadraticModel model;
  const double unit = 2 * max_expected_decrease(at);
  model.scale = (curvature.diagonal() / unit).cwiseSqrt();
  const Eigen::VectorXd inverse = model.scale.cwiseInverse();
  curvature = inverse.asDiagonal() * curvature * inverse.asDiagonal() / unit;
  const Eigen::VectorXd slope = inverse.asDiagonal() * gradient / unit;
  const Eigen::LLT<Eigen::MatrixXd> cholesky(curvature);
  model.residual = cholesky.matrixL().solve(slope);
  model.jacobian = cholesky.matrixU();
  if (const double predicted = model.residual.squaredNorm(); predicted > 1) {
    model.jacobian *= std::sqrt(predicted);
    model.residual /= std::sqrt(predicted);
  }
  return model;
}

}  // namespace isochron
