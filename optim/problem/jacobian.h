// Derivative images of an experiment, of all its terms together.
#pragma once
#include <cstdint>
#include <vector>

#include "optim/problem/gauss_newton.h"
#include "optim/problem/problem.h"

namespace isochron {

/// Values of a pixel, gate and channel in an experiment's images.
double residual_count(const Problem& problem);

/// What linearise() and errors of so many columns take, in bytes: two halves of a Jacobian and square matrices.
double linearisation_bytes(const Problem& problem, double columns);

/// The Jacobian at theta along the columns of `basis`, from the random numbers of one iteration: each term's samples are cut into
/// two halves, an odd number rounded up. It is rendered for a group of columns at a time, each time from the same random numbers.
/// With finite differences as gradient.method, `basis` is not looked at: the columns are those of all unknowns.
JacobianHalves render_jacobian(const Problem& problem, const std::vector<double>& theta, const TangentBasis& basis,
                               std::uint32_t iteration);

/// Half `half` (0 or 1) of so many samples, as above.
SampleRange half_of(int samples, int half);

/// J' W^(1/2) z with a random sign z for each reading, others for each probe: gradients as the noise of readings makes them, with
/// the covariance J'WJ and what the noise of the Jacobian adds. Signs are those of the iteration, samples those of iteration `rendered`, the
/// same for all probes.
std::vector<std::vector<double>> probe_readings(const Problem& problem, const std::vector<double>& theta,
                                                const std::vector<double>& weights, std::uint32_t iteration,
                                                Probes probes, std::uint32_t rendered);

/// Estimates of the diagonal of J'WJ: see Objective::probe_curvature(), without a penalty's part.
std::vector<std::vector<double>> probe_diagonals(const Problem& problem, const std::vector<double>& theta,
                                                 const std::vector<double>& weights, std::uint32_t iteration,
                                                 Probes probes);

/// A basis whose columns are combinations of those of another.
TangentBasis combinations_of(const TangentBasis& basis, const std::vector<std::vector<double>>& coefficients);

}  // namespace isochron
