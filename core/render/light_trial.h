// Whether light subpaths pay.
#pragma once
#include "core/render/passes.h"

namespace isochron {

/// The part of the samples with light subpaths, where they are used: of shares from 0.2 to 0.8 the best costs a fifth less at most
/// (isochron_light_share).
inline constexpr double kLightShare = 0.5;

/// Whether variance x work is clearly less with light subpaths than without. `column`: for the interior term of the derivative along it; null: for
/// images. Some `paths` paths are found with light subpaths, and each tells what its squared contribution would be without: although
/// paths that standard sampling hardly finds may be what decides. `work` grows by what that took (see Renderer::work).
bool light_subpaths_pay(const Scene& scene, const GateSet& gates, EstimatorOptions options, const TangentBasis* column,
                        const Stream& stream, double paths, double& work);

}  // namespace isochron
