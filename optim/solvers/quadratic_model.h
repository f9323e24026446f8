// The quadratic model of a loss that Levenberg-Marquardt works with, made from noisy estimates.
#pragma once
#include <Eigen/Core>

#include "optim/problem/objective.h"

namespace isochron {

/// By how much a loss can be expected to fall at most: down to 0, which no mean of squares falls below, from two
/// standard errors above its estimate. The estimate itself can lie below 0.
double most_fall(const Evaluation& at);

/// loss + gradient . d + d' curvature d / 2, over 2 most_fall, as half a sum of squares: |residual + jacobian u|^2
/// / 2 plus a constant, in dimensionless unknowns u = scale d, for which the curvature's diagonal is 1.
struct QuadraticModel {
  Eigen::VectorXd scale;     ///< of each unknown, > 0
  Eigen::VectorXd residual;  ///< size n
  Eigen::MatrixXd jacobian;  ///< n x n
};

/// From an Evaluation of linearise() whose most_fall is above 0. The curvature is made positive definite. An unbiased
/// estimate from a noisy Jacobian can be indefinite; the one from squares is not, but so much too large that
/// steps stall. Noise pushes eigenvalues (of the matrix scaled by the bound's diagonal) below zero as far as
/// above: those smaller than the most negative one is large cannot be told from noise and are raised to its
/// size. After that the whole curvature is raised, where need be, until the model nowhere predicts a fall
/// by more than most_fall.
QuadraticModel quadratic_model(const Evaluation& at);

}  // namespace isochron
