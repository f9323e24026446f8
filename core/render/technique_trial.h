// What techniques cost, by small renderings.
#pragma once
#include "core/render/passes.h"

namespace isochron {

struct TechniqueTrial {
  const Scene& scene;
  const GateSet& gates;
  EstimatorOptions options;    ///< those of the estimates that are decided about
  const TangentBasis* column;  ///< the derivative along it; null: images
  int block;                   ///< variances are those of sums over so many pixels by as many
  int samples;                 ///< per pixel and batch
};

/// What images and the interior and path-length terms are found by.
struct PathMix {
  bool connections = false;
  double light = 0;  ///< see SamplingMix

  SamplingMix sampling_mix() const { return {connections, connections, light, light}; }
};

struct TrialBatches {
  int count = 0;
  double learning = 0;  ///< work before the first, of guiding (see Renderer::work)
  double work = 0;      ///< of one sample per pixel
  /// Of one sample per pixel, summed over blocks and gates; 0: nothing was seen, or there is one batch.
  double variance = 0;
  bool has_others = false;  ///< paths that connections do not find
  /// Sums of squares of single contributions: of standard sampling, with light subpaths if these are used, and what as many samples
  /// without them would have. A contribution v = f / (n_s p_s + n_l p_l) is the same whichever technique found it, so that the sum of
  /// v g over all that is found is the integral of f g; with g = f / p_s the second moment of standard sampling alone.
  double moment = 0, moment_without_light = 0;
};

/// So many batches by one mix of techniques, of images or of a term of the derivative; none where the term is zero.
TrialBatches run_trial(const TechniqueTrial& trial, PathMix mix, Term term, int batches, const Stream& stream,
                       SceneCache& cache);

}  // namespace isochron
