// The modulated gate: what a continuous-wave camera correlates light with.
#include <cmath>

#include "core/base/constants.h"
#include "core/gates/gate_description.h"

namespace isochron {
namespace {

class Modulated final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers&) override {
    keys.value("frequency_mhz", field::positive(frequency_mhz_), "of the modulation",
               {.required = true, .unit = "MHz"});
    const auto some = [this](const YamlValue& value) {
      if (phases_.empty()) value.fail("holds no gate", "at least one number");
    };
    keys.value("phases", field::checked(field::numbers(phases_), some), "one per gate", {.unit = "degrees"});
  }
  GateShape shape(const GateUnits& units) const override { return GateShape::modulated(wavenumber(units)); }
  std::shared_ptr<GateDescription> stretched(double factor) const override {
    auto copy = std::make_shared<Modulated>(*this);
    copy->frequency_mhz_ /= factor;
    return copy;
  }

  bool has_centers() const override { return false; }
  GateMarks marks() const override { return {phases_, "degrees"}; }
  /// Where the cosine is one.
  std::vector<double> own_centers(const GateUnits& units) const override {
    std::vector<double> centers = phases_;
    for (double& center : centers) center *= kPi / 180 / wavenumber(units);
    return centers;
  }
  bool unbounded() const override { return true; }
  bool needs_metres() const override { return true; }

 private:
  /// Radians per scene unit.
  double wavenumber(const GateUnits& units) const {
    return kTwoPi * 1e6 * frequency_mhz_ / kSpeedOfLight * units.scene_unit_m;
  }

  double frequency_mhz_ = 0;
  std::vector<double> phases_{0, 90, 180, 270};
};

}  // namespace

GateShape GateShape::modulated(double wavenumber) {
  require_positive(wavenumber, "wavenumber");
  GateShape shape = steady();
  shape.kind_ = GateKind::modulated;
  shape.wavenumber_ = wavenumber;
  shape.detail_ = 1 / wavenumber;
  return shape;
}

extern const GateKindEntry kModulated;
const GateKindEntry kModulated{"modulated", "cos(2 pi f l / c - phase), a continuous-wave camera's correlation",
                               make_gate<Modulated>};

}  // namespace isochron
