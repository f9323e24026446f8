// How strong smoothing has to be, by what the data say.
//
// Penalty and likelihood together are a posterior, and the weight of a penalty is the precision of its prior. The weight w that makes the
// data most probable, the posterior taken for normal, meets 2 w E = g: E is the penalty of what was found per unit of w, and
// g = rank - tr((H + P)^-1 P) counts what the data determine rather than the prior (MacKay, "Bayesian interpolation", 1992). The
// trace comes from samples of the posterior (RenderedCurvature::samples).
#pragma once
#include <vector>

#include "optim/problem/problem.h"

namespace isochron {

/// Samples of the posterior, each of which knows a trace to a standard error of sqrt(2 rank).
inline constexpr int kTraceSamples = 2;

/// By what the weight of each parameter's smoothing is to be multiplied, in the order of the blocks; 1 where the parameter has
/// none or asks for no `evidence`. Of bending, or where there is none of slopes: slopes of a surface that bends are about its motion within a
/// level, which is no property of it. At theta, where a fit to counts has come to rest. The same for any number of threads and ranks.
std::vector<double> evidence_factors(const Problem& problem, const GatedImage& target,
                                     const std::vector<double>& theta);

/// How many of those unknowns that lie at no bound the data determine rather than penalties: all, less tr((H + P)^-1 P) of the parameters that
/// smoothing or a prior holds. `samples`: of the posterior at theta (RenderedCurvature::samples), one at least.
double determined_unknowns(const Problem& problem, const GatedImage& target, const std::vector<char>& free,
                           const std::vector<std::vector<double>>& samples);

}  // namespace isochron
