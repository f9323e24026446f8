// The steady gate: all light, whatever its length.
#include <limits>

#include "core/gates/gate_description.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

class Steady final : public GateDescription {
 public:
  void describe(Keys&, const ReadNumbers&) override {}
  GateShape shape(const GateUnits&) const override { return GateShape::steady(); }
  std::shared_ptr<GateDescription> stretched(double) const override {
    auto copy = std::make_shared<Steady>(*this);
    return copy;
  }
  bool has_centers() const override { return false; }
  bool unbounded() const override { return true; }
};

}  // namespace

GateShape GateShape::steady() {
  GateShape shape;
  shape.lower_ = -kInfinity;
  shape.upper_ = kInfinity;
  shape.width_ = shape.detail_ = kInfinity;
  return shape;
}

extern const GateKindEntry kSteady;
const GateKindEntry kSteady{"steady", "all light, whatever its length", make_gate<Steady>};

}  // namespace isochron
