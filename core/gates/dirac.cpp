// The Dirac gate: light of one length.
#include "core/gates/gate_description.h"

namespace isochron {
namespace {

class Dirac final : public GateDescription {
 public:
  void describe(Keys&, const ReadNumbers&) override {}
  GateShape shape(const GateUnits&) const override { return GateShape::dirac(); }
  std::shared_ptr<GateDescription> stretched(double) const override { return std::make_shared<Dirac>(*this); }
};

}  // namespace

GateShape GateShape::dirac() {
  GateShape shape;
  shape.kind_ = GateKind::dirac;
  return shape;
}

extern const GateKindEntry kDirac;
const GateKindEntry kDirac{"dirac", "light of one length", make_gate<Dirac>};

}  // namespace isochron
