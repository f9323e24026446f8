// How `sampling: auto` decides: a trial of standard sampling, ellipsoidal connections and both combined.
#pragma once
#include "core/render/renderer.h"

namespace isochron {

/// The mix of techniques with the least variance x work, found by rendering small images (at most 4096 pixels,
/// some ten thousand paths each), and, where `basis` has columns, the interior term of the derivative along a
/// random combination of them. Depends on the arguments alone. Gates much wider or narrower than where the
/// techniques cross need no trial; other sampling than automatic none either.
SamplingMix measure_mix(const Scene& scene, const GateSet& gates, const EstimatorOptions& options,
                        const TangentBasis* basis, const Stream& stream);

}  // namespace isochron
