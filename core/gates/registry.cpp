// The kinds of gates: a name each.
#include "core/gates/gate_description.h"

namespace isochron {

extern const GateKindEntry kSteady, kGaussian, kDirac, kBoxcar, kTruncatedGaussian, kTabulated, kBins, kModulated;

std::span<const GateKindEntry* const> gate_kinds() {
  static constexpr const GateKindEntry* kKinds[] = {&kSteady,    &kGaussian, &kDirac,    &kBoxcar, &kTruncatedGaussian,
                                                    &kTabulated, &kBins,     &kModulated};
  return kKinds;
}

}  // namespace isochron
