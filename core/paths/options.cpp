#include "core/paths/options.h"

#include <algorithm>

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

bool may_keep_length(const Scene& scene) {
  const auto emits = [](const Shape& shape) { return shape.emission.emits(); };
  return !scene.capture && scene.lights.empty() && std::ranges::any_of(scene.shapes, emits);
}

SamplingMix sampling_mix(const EstimatorOptions& options, const GateSet& gates, const Scene& scene) {
  // Gates that together cover less than this part of the path length: standard sampling throws too many paths away.
  constexpr double kNarrow = 0.02;
  // Gates so narrow that coupled pairs are noisier than paths that keep their lengths: from 0.5 % down on the cube, from 0.1 % down in
  // the reference box (isochron_gate_width).
  constexpr double kSteep = 0.003;
  if (gates.shape().is_unbounded() || options.sampling == Sampling::standard) return {0, 0};
  SamplingMix mix{1, 1};
  if (options.sampling == Sampling::automatic && !gates.shape().is_dirac()) {
    if (scene.capture) return {0, 0};  // area sampling serves all gates at once
    if (options.mix)
      mix = *options.mix;
    else if (gates.relative_coverage() >= kNarrow)
      mix = {0, 0};
  }
  mix.keep_length =
      mix.interior > 0 && may_keep_length(scene) && options.keep_length.value_or(gates.relative_width() < kSteep);
  return mix;
}

}  // namespace isochron
