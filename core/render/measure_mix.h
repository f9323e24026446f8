// How `sampling: auto` decides between standard sampling and ellipsoidal connections, and on light subpaths.
#pragma once
#include <limits>

#include "core/render/renderer.h"

namespace isochron {

/// What derivatives are for: images, whose every pixel counts, or gradients of a loss, which are sums over
/// pixels. The two paths of a coupled pair lie a gate's width apart and cancel in sums where they do not in a
/// pixel.
enum class Purpose { images, gradients };

/// Samples per pixel that will be spent with the chosen mix, on images and on the interior term of their derivative (zero: no trial, the
/// width of the gates decides; infinite: no limit on the trial), and those of the other terms for each of the interior term.
struct Job {
  double image = std::numeric_limits<double>::infinity();
  double interior = std::numeric_limits<double>::infinity();
  double visibility = 1, path_length = 1;
};

/// The mix of techniques with the least variance x work, found by trials on small images (at most 4096 pixels), and, where `basis` has
/// columns, on the derivative along a random combination of them, all of its terms together. Depends only on the arguments. For
/// gradients, variance is that of sums over blocks of a quarter of the image's width. Under gates much wider or narrower than where
/// standard sampling and connections cost the same, only one of them is tried; each without and with light subpaths. Other sampling than
/// automatic needs no trial. Together trials take about a tenth of the work of what they decide about at most; where that is too little
/// to tell techniques apart there is none, and the width of the gates decides. `trial_work`, where given, gets the work of all trials
/// (see Renderer::work).
SamplingMix measure_mix(const Scene& scene, const GateSet& gates, const EstimatorOptions& options,
                        const TangentBasis* basis, const Stream& stream, Purpose purpose, const Job& job = {},
                        double* trial_work = nullptr);

}  // namespace isochron
