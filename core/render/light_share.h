// Which part of the samples has light subpaths.
#pragma once
#include "core/render/passes.h"

namespace isochron {

/// The part of the samples with light subpaths, beside standard ones, that has the least variance x work; 0: none. `column`: for the interior term
/// of the derivative along it; null: for images. Some `paths` paths are found with light subpaths, and each tells for every share at once
/// what its squared contribution would be: also for none, although paths that standard sampling hardly finds are what
/// decides. `work` grows by what that took (see Renderer::work).
double measure_light_share(const Scene& scene, const GateSet& gates, EstimatorOptions options,
                           const TangentBasis* column, const Stream& stream, double paths, double& work);

}  // namespace isochron
