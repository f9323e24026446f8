// The quadratic model of a loss that Levenberg-Marquardt works with, made from noisy estimates.
#pragma once
#include <Eigen/Core>

#include "optim/objective.h"

namespace isochron {

/// loss + gradient . d + d' curvature d / 2, over 2 loss, as half a sum of squares: |residual + jacobian u|^2
/// / 2 plus a constant, in dimensionless unknowns u = scale d, for which the curvature's diagonal is 1.
struct QuadraticModel {
  Eigen::VectorXd scale;     ///< of each unknown, > 0
  Eigen::VectorXd residual;  ///< size n
  Eigen::MatrixXd jacobian;  ///< n x n
};

/// From an Evaluation of linearise() of a loss above 0. The curvature is made positive definite. An unbiased
/// estimate from a noisy Jacobian can be indefinite; the one from squares is not, but so much too large that
/// steps stall. Noise pushes eigenvalues (of the matrix scaled by the bound's diagonal) below zero as far as
/// above: those smaller than the most negative one is large cannot be told from noise and are raised to its
/// size. After that the whole curvature is raised, where need be, until the model nowhere predicts a loss
/// below zero, which no sum of squares reaches.
QuadraticModel quadratic_model(const Evaluation& at);

}  // namespace isochron
