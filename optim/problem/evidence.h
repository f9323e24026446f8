// How strong smoothing has to be, by what the data say.
//
// Penalty and likelihood together are a posterior, and the weight of a penalty is the precision of its prior. The weight w that makes the
// data most probable, the posterior taken for normal, meets 2 w E = g: E is the penalty of what was found per unit of w, and
// g = tr((H + P)^-1 H) counts what the data determine rather than the prior (MacKay, "Bayesian interpolation", 1992). It comes from
// samples of the posterior (PosteriorSamples). rank - tr((H + P)^-1 P) is the same number, as the difference of two that are much larger.
#pragma once
#include <vector>

#include "optim/problem/problem.h"
#include "optim/problem/rendered_curvature.h"

namespace isochron {

/// The weight of a parameter's smoothing that evidence is about: of variation, else of bending, else of slopes. Slopes of a surface that bends
/// are about its motion within a level, which is no property of it.
double ParameterSpec::*weight_by_evidence(const ParameterSpec& spec);

/// By what that weight of each parameter is to be multiplied, in the order of the blocks; 1 where the parameter has none or asks for no
/// `evidence`. At theta, where a fit to counts has come to rest. The same for any number of threads and ranks. `samples`: of the posterior
/// at theta, one at least.
std::vector<double> evidence_factors(const Problem& problem, const GatedImage& target, const std::vector<double>& theta,
                                     const PosteriorSamples& samples);
/// The same with samples of its own.
std::vector<double> evidence_factors(const Problem& problem, const GatedImage& target,
                                     const std::vector<double>& theta);

/// How many of those unknowns that lie at no bound the data determine rather than penalties: all, and tr((H + P)^-1 H) of the parameters that
/// smoothing or a prior holds. `samples`: of the posterior at theta, one at least.
double determined_unknowns(const Problem& problem, const std::vector<char>& free, const PosteriorSamples& samples);

}  // namespace isochron
