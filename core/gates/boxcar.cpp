// The boxcar: constant within its width.
#include <cmath>

#include "core/gates/gate_description.h"

namespace isochron {
namespace {

class Boxcar final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers&) override {
    keys.value("width", field::positive(width_), "from end to end", {.required = true, .unit = "`unit`"});
  }
  GateShape shape(const GateUnits& units) const override { return GateShape::boxcar(units.length * width_); }
  std::shared_ptr<GateDescription> stretched(double factor) const override {
    auto copy = std::make_shared<Boxcar>(*this);
    copy->width_ *= factor;
    return copy;
  }

 private:
  double width_ = 0;
};

}  // namespace

GateShape GateShape::boxcar(double width) {
  require_positive(width, "width");
  GateShape shape;
  shape.kind_ = GateKind::boxcar;
  shape.lower_ = -0.5 * width;
  shape.upper_ = 0.5 * width;
  shape.width_ = shape.detail_ = width / std::sqrt(12.0);
  shape.peak_ = 1 / width;
  shape.segments_.push_back({shape.peak_, {Side::Form::dirac, shape.lower_, 0}, {Side::Form::dirac, shape.upper_, 0}});
  shape.finish_parts();
  return shape;
}

extern const GateKindEntry kBoxcar;
const GateKindEntry kBoxcar{"boxcar", "constant within its width", make_gate<Boxcar>};

}  // namespace isochron
