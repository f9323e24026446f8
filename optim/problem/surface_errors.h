// How far a surface may be off, at each of its vertices.
#pragma once
#include <vector>

#include "optim/problem/problem.h"

namespace isochron {

/// Whether there is such a parameter: one that moves the vertices of a shape that bends by a prior, which makes up for what readings leave
/// open. Without, single vertices are rarely determined.
bool has_surface_errors(const Problem& problem);

/// Standard errors of all vertices of the scene along their normals, scene units, at theta: root mean square of what samples of the posterior
/// (RenderedCurvature::samples) move them by. NaN for vertices that no such parameter moves, and where `scale`, see variance_scale(), is
/// not known.
std::vector<double> surface_errors(const Problem& problem, const PosteriorSamples& samples,
                                   const std::vector<double>& theta, double scale);

}  // namespace isochron
