#include "optim/problem/gauss_newton.h"

#include <Eigen/Core>

namespace isochron {

void gauss_newton(JacobianHalves& jacobian, const std::vector<double>& adjoint, const std::vector<double>& weight,
                  Evaluation& into) {
  const auto rows = static_cast<Eigen::Index>(jacobian.residuals),
             columns = static_cast<Eigen::Index>(jacobian.unknowns);
  Eigen::Map<Eigen::MatrixXd> a(jacobian.half[0].data(), rows, columns), b(jacobian.half[1].data(), rows, columns);
  const Eigen::Map<const Eigen::VectorXd> slope(adjoint.data(), rows), weights(weight.data(), rows);

  into.gradient.resize(jacobian.unknowns);
  Eigen::Map<Eigen::VectorXd> gradient(into.gradient.data(), columns);
  gradient = (a.transpose() * slope + b.transpose() * slope) / 2;

  const Eigen::VectorXd root = weights.cwiseSqrt();
  a.array().colwise() *= root.array();
  b.array().colwise() *= root.array();
  into.curvature.resize(jacobian.unknowns * jacobian.unknowns);
  into.curvature_bound.resize(into.curvature.size());
  Eigen::Map<Eigen::MatrixXd> curvature(into.curvature.data(), columns, columns),
      bound(into.curvature_bound.data(), columns, columns);
  const Eigen::MatrixXd product = a.transpose() * b;
  curvature = (product + product.transpose()) / 2;
  a += b;
  bound.noalias() = (a.transpose() * a) / 4;
}

}  // namespace isochron
