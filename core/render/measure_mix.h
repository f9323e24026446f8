// How `sampling: auto` decides: a trial of standard sampling, ellipsoidal connections and both combined.
#pragma once
#include "core/render/renderer.h"

namespace isochron {

/// What derivatives are for: images, whose every pixel counts, or gradients of a loss, which are sums over
/// pixels. The two paths of a coupled pair lie a gate's width apart and cancel in sums where they do not in a
/// pixel.
enum class Purpose { images, gradients };

/// The mix of techniques with the least variance x work, found by rendering small images (at most 4096
/// pixels, some hundred thousand paths each), and, where `basis` has columns, the interior term of the derivative
/// along a random combination of them. Depends on the arguments alone. For gradients, variance is that of
/// sums over blocks of a quarter of the image's width. Gates much wider or narrower than where the techniques
/// cross need no trial; other sampling than automatic none either. Where connections find all of a term and paths
/// bounce once, so that each technique could find them all, rates are chosen by a trial of that term's derivative.
SamplingMix measure_mix(const Scene& scene, const GateSet& gates, const EstimatorOptions& options,
                        const TangentBasis* basis, const Stream& stream, Purpose purpose);

}  // namespace isochron
