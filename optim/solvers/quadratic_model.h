// The quadratic model of a loss that Levenberg-Marquardt works with, made from noisy estimates.
#pragma once
#include <Eigen/Core>

#include "optim/problem/objective.h"

namespace isochron {

/// Upper bound of the decrease to be expected of a loss: from two standard errors above its estimate down to 0, which no mean
/// of squares falls below. The estimate itself can lie below 0.
double max_expected_decrease(const Evaluation& at);

/// loss + gradient . d + d' curvature d / 2, over 2 max_expected_decrease, as half a sum of squares: |residual + jacobian u|^2
/// / 2 plus a constant, in dimensionless unknowns u = scale d, for which the curvature's diagonal is 1.
struct QuadraticModel {
  Eigen::VectorXd scale;     ///< of each unknown, > 0
  Eigen::VectorXd residual;  ///< size n
  Eigen::MatrixXd jacobian;  ///< n x n
};

/// From an Evaluation of linearise() whose max_expected_decrease is above 0. The curvature is made positive definite. An unbiased
/// estimate from a noisy Jacobian can be indefinite; the one from squares is not, but so much too large that
/// steps stall. Noise pushes eigenvalues (of the matrix scaled by the bound's diagonal) below zero as far as
/// above: those smaller than the size of the most negative one may be noise and are raised to its
/// size. After that the whole curvature is raised, where need be, until the model nowhere predicts a fall
/// by more than max_expected_decrease.
QuadraticModel quadratic_model(const Evaluation& at);

}  // namespace isochron
