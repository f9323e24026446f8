// The gaussian, whole and truncated.
#include <cmath>
#include <numbers>

#include "core/base/constants.h"
#include "core/gates/gate_description.h"

namespace isochron {
namespace {

/// |x| / sigma at which the gaussian falls to 2^-53 of its peak: sqrt(106 ln 2).
constexpr double kGaussianReach = 8.5717;

/// Variance of the standard normal cut to (-c, c). Integration by parts turns both moments into the positive
/// series sum c^(2k) / (2k+1)!!, which loses no digits however short the interval.
double truncated_variance(double c) {
  double term = 1, sum = 0;
  for (int k = 1; term > sum * 0x1p-60; ++k) {
    term *= c * c / (2 * k + 1);
    sum += term;
  }
  return sum / (1 + sum);
}

/// The key that both have.
void describe_sigma(Keys& keys, double& sigma) {
  keys.value("sigma", field::positive(sigma), "standard deviation", {.required = true, .unit = "`unit`"});
}

class Gaussian final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers&) override { describe_sigma(keys, sigma_); }
  GateShape shape(const GateUnits& units) const override { return GateShape::gaussian(units.length * sigma_); }
  std::shared_ptr<GateDescription> stretched(double factor) const override {
    auto copy = std::make_shared<Gaussian>(*this);
    copy->sigma_ *= factor;
    return copy;
  }

 private:
  double sigma_ = 0;
};

class TruncatedGaussian final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers&) override {
    describe_sigma(keys, sigma_);
    keys.value("half_width", field::positive(half_width_), "from the centre to either end",
               {.required = true, .unit = "`unit`"});
  }
  GateShape shape(const GateUnits& units) const override {
    return GateShape::truncated_gaussian(units.length * sigma_, units.length * half_width_);
  }
  std::shared_ptr<GateDescription> stretched(double factor) const override {
    auto copy = std::make_shared<TruncatedGaussian>(*this);
    copy->sigma_ *= factor;
    copy->half_width_ *= factor;
    return copy;
  }

 private:
  double sigma_ = 0, half_width_ = 0;
};

}  // namespace

void GateShape::set_gaussian(double sigma, double cut) {
  const double reach = cut / sigma;
  sigma_ = sigma;
  upper_ = cut;
  lower_ = -cut;
  peak_ = 1 / (sigma * std::sqrt(kTwoPi));
  exponent_ = -0.5 * std::numbers::log2e / sigma / sigma;
  slope_factor_ = -1 / sigma / sigma;
  const double smooth = -std::expm1(-0.5 * reach * reach);
  segments_.push_back({peak_ * smooth, {Side::Form::rayleigh, -sigma, smooth}, {Side::Form::rayleigh, sigma, smooth}});
}

GateShape GateShape::gaussian(double sigma) {
  require_positive(sigma, "sigma");
  GateShape shape;
  shape.kind_ = GateKind::gaussian;
  shape.set_gaussian(sigma, kGaussianReach * sigma);
  shape.width_ = shape.detail_ = sigma;
  shape.finish_parts();
  return shape;
}

GateShape GateShape::truncated_gaussian(double sigma, double half_width) {
  require_positive(sigma, "sigma");
  require_positive(half_width, "half_width");
  GateShape shape;
  shape.kind_ = GateKind::truncated_gaussian;
  const double c = half_width / sigma;
  if (c >= kGaussianReach) {  // the cut is below double rounding: no jumps left
    shape.set_gaussian(sigma, kGaussianReach * sigma);
    shape.width_ = shape.detail_ = sigma;
  } else {
    shape.set_gaussian(sigma, half_width);
    shape.outside_ = 0.5 * std::erfc(c * std::sqrt(0.5));
    shape.mass_ = std::erf(c * std::sqrt(0.5));
    shape.width_ = shape.detail_ = sigma * std::sqrt(truncated_variance(c));
    shape.segments_.push_back({shape.peak_ * std::exp(-0.5 * c * c),
                               {Side::Form::dirac, -half_width, 0},
                               {Side::Form::dirac, half_width, 0}});
  }
  shape.finish_parts();
  return shape;
}

extern const GateKindEntry kGaussian;
const GateKindEntry kGaussian{"gaussian", "a normal density of path length", make_gate<Gaussian>};
extern const GateKindEntry kTruncatedGaussian;
const GateKindEntry kTruncatedGaussian{"truncated_gaussian", "zero beyond `half_width` from its centre",
                                       make_gate<TruncatedGaussian>};

}  // namespace isochron
