#include "core/paths/options.h"

namespace isochron {

const char* name(Term term) {
  switch (term) {
    case Term::interior:
      return "interior";
    case Term::visibility:
      return "visibility";
    case Term::path_length:
      return "path_length";
  }
  return "";
}

SamplingMix sampling_mix(const EstimatorOptions& options, const GateSet& gates, const Scene& scene) {
  // Gates that together cover less than this part of the path length: standard sampling throws too many paths away.
  constexpr double kNarrow = 0.02;
  if (gates.shape().is_unbounded() || options.sampling == Sampling::standard) return {0, 0};
  if (options.sampling == Sampling::ellipsoidal) return {1, 1};
  if (scene.capture) return {0, 0};  // area sampling serves all gates at once
  if (options.mix) return *options.mix;
  return gates.relative_coverage() < kNarrow ? SamplingMix{1, 1} : SamplingMix{0, 0};
}

}  // namespace isochron
