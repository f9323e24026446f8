#pragma once
#include <vector>

#include "optim/problem/objective.h"

namespace isochron {

/// Two independent estimates of a Jacobian, residuals x unknowns, a column (one unknown) after the other.
struct JacobianHalves {
  std::size_t residuals = 0, unknowns = 0;
  std::vector<double> half[2];
  JacobianHalves(std::size_t r, std::size_t u)
      : residuals(r), unknowns(u), half{std::vector<double>(r * u, 0.0), half[0]} {}
};

/// Gradient and curvatures of a loss: gradient = J'adjoint with adjoint = dLoss/dr, and the curvature J' W J with
/// W = diag(weight), the curvature of the loss in each residual. The Jacobian is overwritten.
void gauss_newton(JacobianHalves& jacobian, const std::vector<double>& adjoint, const std::vector<double>& weight,
                  Evaluation& into);

}  // namespace isochron
