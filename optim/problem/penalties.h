// What an experiment's parameters add to its loss, and what of that is a prior.
#pragma once
#include <vector>

#include "optim/experiment/parameter_spec.h"
#include "optim/problem/parameters.h"
#include "optim/problem/smoothing.h"

namespace isochron {

/// Weight of `tangential` that keeps vertices on their normals: a standard deviation of a twentieth of their distance.
inline constexpr double kHeldTangents = 200;

/// Forms are those at the initial values. `scene`: as loaded.
QuadraticPenalty penalty_of(const std::vector<ParameterSpec>& specs, const Parameters& parameters, const Scene& scene);

/// The penalty without what is no property of what is looked for, as the prior of a posterior: slopes of offsets of a surface that bends keep
/// a fit near where it began. Errors with them would be those of its last step. As nothing determines motion within a surface of one
/// albedo, tangents are held in their place.
QuadraticPenalty prior_of(std::vector<ParameterSpec> specs, const Parameters& parameters, const Scene& scene);

}  // namespace isochron
