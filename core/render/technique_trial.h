// What standard sampling and ellipsoidal connections cost, by a small rendering of each.
#pragma once
#include "core/render/passes.h"

namespace isochron {

struct TechniqueTrial {
  const Scene& scene;
  const GateSet& gates;
  EstimatorOptions options;    ///< those of the estimates that are decided about; light subpaths are given
  const TangentBasis* column;  ///< the interior term of the derivative along it; null: images
  int block;                   ///< variances are those of sums over so many pixels by as many
  int samples;                 ///< per pixel and batch
};

struct TrialBatches {
  int count = 0;
  double work = 0;          ///< of one, see Renderer::work
  double variance = 0;      ///< of one, summed over blocks and gates; 0: nothing was seen, or there is one batch
  bool has_others = false;  ///< paths that connections do not find
};

/// Batches of one technique: at most so many, and, beyond the first, as long as they take no more than this work.
TrialBatches run_trial(const TechniqueTrial& trial, bool connections, int batches, double work, const Stream& stream,
                       SceneCache& cache);

}  // namespace isochron
