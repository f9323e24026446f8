// How well the readings determine the unknowns, from the Gauss-Newton matrix of the loss where a run ends.
#pragma once
#include <vector>

#include "optim/problem/objective.h"
#include "optim/problem/problem.h"

namespace isochron {

/// What the inverse of the Gauss-Newton matrix H is multiplied with to get the covariance of the unknowns, the loss being a mean
/// over N readings. Counts: 1 / N, as N H is Fisher's information. Else 2 s^2 / N with s^2 the mean squared error that is left,
/// taken for independent errors of the readings; NaN where that is not above 0. Noise of the renderer is not included.
double variance_scale(const Problem& problem, const Evaluation& at);

/// Of each unknown: root of `scale` times the diagonal of the inverse of `matrix` (row after row, n x n). Empty where
/// the matrix, which is noisy, is not positive definite, or larger than 1000 x 1000.
std::vector<double> standard_errors(const std::vector<double>& matrix, double scale);

/// Root of `scale` over each entry of the matrix's diagonal: as if all other unknowns were known, a lower bound.
std::vector<double> least_standard_errors(const std::vector<double>& diagonal, double scale);

}  // namespace isochron
