// The lengths that ellipsoidal connections are made for: drawn from the gates or, for the gates' derivative, in pairs from
// dW (theory sections 3 and 4).
#pragma once
#include <algorithm>
#include <vector>

#include "core/base/random.h"
#include "core/films/sinks.h"
#include "core/gates/gate.h"
#include "core/techniques/gate_pick.h"

namespace isochron {

/// What the gate's derivative asks of a pass.
struct GatePass {
  bool value = false;  ///< lengths drawn from W
  GateWeights use;     ///< of those
  bool pairs = false;  ///< lengths drawn in pairs from dW
  PairPart part = PairPart::smooth;
  bool coupled = true;
};

/// One length drawn from W, or the two sides of a pair drawn from dW (first plus, then minus).
struct TargetLength {
  double tau[2] = {0, 0};
  bool present[2] = {false, false};
  bool jump[2] = {false, false};  ///< at a jump of the gate
  bool pair = false;
  int gate = 0;   ///< of a pair
  int index = 0;  ///< among the lengths gathered for
  double scale = 0;
  double longest() const { return std::max(present[0] ? tau[0] : 0, present[1] ? tau[1] : 0); }
  double shortest() const { return present[0] && present[1] ? std::min(tau[0], tau[1]) : longest(); }
};

/// Lengths for connections that serve `pixel` (or, of the camera's own, the whole image) take the place of `targets`.
inline void draw_targets(const GatePass& pass, const GateSet& gates, const GatePick& pick_gate, int pixel, Rng& rng,
                         std::vector<TargetLength>& targets) {
  targets.clear();
  if (pass.value) {
    const double pick = rng.uniform(), u = rng.uniform();
    const auto length = pick_gate.sample_length(pixel, pick, u);
    if (length && *length > 0) {
      TargetLength t;
      t.tau[0] = *length;
      t.present[0] = true;
      t.scale = 1 / pick_gate.length_pdf(pixel, t.tau[0]);
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
  t.jump[0] = pair.plus_is_jump;
  t.jump[1] = pair.minus_is_jump;
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
