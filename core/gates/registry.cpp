// The kinds of gates: a name each.
#include "core/gates/gate_description.h"

namespace isochron {

extern const GateKindEntry kSteady, kGaussian, kBoxcar, kTruncatedGaussian, kTabulated;

std::span<const GateKindEntry* const> gate_kinds() {
  static constexpr const GateKindEntry* kKinds[] = {&kSteady, &kGaussian, &kBoxcar, &kTruncatedGaussian, &kTabulated};
  return kKinds;
}

}  // namespace isochron
