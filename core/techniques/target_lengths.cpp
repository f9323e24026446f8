#include "core/techniques/target_lengths.h"

namespace isochron {

void draw_targets(const GatePass& pass, const GateSet& gates, const GatePick& pick_gate, int pixel, Rng& rng,
                  std::vector<TargetLength>& targets) {
  targets.clear();
  if (pass.value) {
    const double pick = rng.uniform(), u = rng.uniform();
    const auto length = pick_gate.sample_length(pixel, pick, u);
    // At the very end of a gate its value may have rounded to zero.
    const double pdf = length && *length > 0 ? pick_gate.length_pdf(pixel, *length) : 0;
    if (pdf > 0) {
      TargetLength t;
      t.tau[0] = *length;
      t.present[0] = true;
      t.scale = 1 / pdf;
      targets.push_back(t);
    }
  }
  if (!pass.pairs) return;
  double pick = rng.uniform();
  const double u = rng.uniform();
  TargetLength t;
  t.pair = true;
  t.gate = pick_gate.sample(pixel, pick);
  const double mass = gates.shape().pair_mass(pass.part);
  if (!(mass > 0) || t.gate < 0) return;
  t.scale = mass / pick_gate.probability(pixel, t.gate);
  const CoupledPair pair = gates.shape().sample_pair(pass.part, u);
  t.tau[0] = gates.center(t.gate) + pair.plus;
  t.tau[1] = gates.center(t.gate) + pair.minus;
  t.present[0] = pair.has_plus && t.tau[0] > 0;
  t.present[1] = pair.has_minus && t.tau[1] > 0;
  if (pass.coupled) {
    targets.push_back(t);
    return;
  }
  for (int i = 0; i < 2; ++i) {
    TargetLength alone = t;
    alone.present[1 - i] = false;
    targets.push_back(alone);
  }
}

}  // namespace isochron
