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

/// Which lengths a pass draws for its connections.
struct GatePass {
  bool value = false;  ///< lengths drawn from W
  /// How the gate enters contributions of those.
  GateUse use = GateUse::value_and_slope;
  bool pairs = false;  ///< lengths drawn in pairs from dW
  PairPart part = PairPart::smooth;
  bool coupled = true;
};

/// One length drawn from W, or the two sides of a pair drawn from dW (first plus, then minus).
struct TargetLength {
  double tau[2] = {0, 0};
  bool present[2] = {false, false};
  bool pair = false;
  int gate = 0;   ///< of a pair
  int index = 0;  ///< among the lengths gathered for
  double scale = 0;
  double longest() const { return std::max(present[0] ? tau[0] : 0, present[1] ? tau[1] : 0); }
  double shortest() const { return present[0] && present[1] ? std::min(tau[0], tau[1]) : longest(); }
};

/// Lengths for connections that serve `pixel` (or, of the camera's own, the whole image) take the place of `targets`.
void draw_targets(const GatePass& pass, const GateSet& gates, const GatePick& pick_gate, int pixel, Rng& rng,
                  std::vector<TargetLength>& targets);

}  // namespace isochron
