#include "core/gates/gate.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <string>

#include "core/base/constants.h"
#include "core/base/error.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// Largest double below one: where a quantile is inverted, one itself would mean infinity.
constexpr double kBelowOne = 1 - 0x1p-53;

/// |x| / sigma at which the gaussian falls to 2^-53 of its peak: sqrt(106 ln 2).
constexpr double kGaussianReach = 8.5717;

void require_positive(double value, const char* name) {
  if (!(value > 0 && std::isfinite(value))) {
    throw InputError(std::string(name) + " must be positive and finite");
  }
}

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

}  // namespace

GateShape GateShape::steady() {
  GateShape shape;
  shape.lower_ = -kInfinity;
  shape.upper_ = kInfinity;
  shape.width_ = kInfinity;
  return shape;
}

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
  shape.width_ = sigma;
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
    shape.width_ = sigma;
  } else {
    shape.set_gaussian(sigma, half_width);
    shape.outside_ = 0.5 * std::erfc(c * std::sqrt(0.5));
    shape.mass_ = std::erf(c * std::sqrt(0.5));
    shape.width_ = sigma * std::sqrt(truncated_variance(c));
    shape.segments_.push_back(
        {shape.peak_ * std::exp(-0.5 * c * c), {Side::Form::atom, -half_width, 0}, {Side::Form::atom, half_width, 0}});
  }
  shape.finish_parts();
  return shape;
}

GateShape GateShape::boxcar(double width) {
  require_positive(width, "width");
  GateShape shape;
  shape.kind_ = GateKind::boxcar;
  shape.lower_ = -0.5 * width;
  shape.upper_ = 0.5 * width;
  shape.width_ = width / std::sqrt(12.0);
  shape.peak_ = 1 / width;
  shape.segments_.push_back({shape.peak_, {Side::Form::atom, shape.lower_, 0}, {Side::Form::atom, shape.upper_, 0}});
  shape.finish_parts();
  return shape;
}

double GateShape::sample(double u) const {
  if (is_gaussian_inside()) {
    // Both halves of the law are read from the lower tail, where its distribution function is accurate.
    const bool upper_half = u > 0.5;
    const double tail = outside_ + (upper_half ? 1 - u : u) * mass_;
    const double x = sigma_ * normal_quantile_lower(tail, -std::abs(u - 0.5) * mass_);
    return std::clamp(upper_half ? -x : x, lower_, upper_);
  }
  if (kind_ != GateKind::tabulated) return lower_ + u * (upper_ - lower_);
  const double target = u * cumulative_.back();
  const auto next = std::upper_bound(cumulative_.begin(), cumulative_.end(), target);
  const int i = std::min(static_cast<int>(next - cumulative_.begin()) - 1, last_interval_);
  const double rest = target - cumulative_[i];
  if (rest <= 0) return offsets_[i];
  // Smaller root of v t + slope t^2 / 2 = rest, in the form that does not cancel.
  const double root = std::sqrt(std::max(values_[i] * values_[i] + 2 * slopes_[i] * rest, 0.0));
  return std::min(offsets_[i] + 2 * rest / (values_[i] + root), offsets_[i + 1]);
}

double GateShape::quantile(const Side& side, double u) {
  switch (side.form) {
    case Side::Form::uniform:
      return side.from + u * (side.to - side.from);
    case Side::Form::rayleigh:
      return side.from * std::sqrt(-2 * std::log1p(-u * side.to));
    case Side::Form::atom:
      break;
  }
  return side.from;
}

CoupledPair GateShape::sample_pair(PairPart part, double u) const {
  const Part& drawn = parts_[static_cast<int>(part)];
  const auto next = std::upper_bound(drawn.cumulative.begin(), drawn.cumulative.end() - 1, u);
  const std::size_t k = static_cast<std::size_t>(next - drawn.cumulative.begin());
  const double before = k > 0 ? drawn.cumulative[k - 1] : 0.0;
  const double rest = std::clamp((u - before) / (drawn.cumulative[k] - before), 0.0, kBelowOne);

  const Segment& segment = segments_[drawn.segments[k]];
  CoupledPair pair;
  pair.plus = quantile(segment.plus, rest);
  pair.minus = quantile(segment.minus, rest);
  pair.plus_is_jump = segment.plus.form == Side::Form::atom;
  pair.minus_is_jump = segment.minus.form == Side::Form::atom;
  pair.has_plus = pair.plus_is_jump == (part == PairPart::atoms);
  pair.has_minus = pair.minus_is_jump == (part == PairPart::atoms);
  return pair;
}

void GateShape::finish_parts() {
  const auto add = [this](PairPart part, int index) {
    Part& target = parts_[static_cast<int>(part)];
    target.mass += segments_[index].mass;
    target.segments.push_back(index);
    target.cumulative.push_back(target.mass);
  };
  for (int i = 0; i < static_cast<int>(segments_.size()); ++i) {
    const bool plus = segments_[i].plus.form == Side::Form::atom;
    const bool minus = segments_[i].minus.form == Side::Form::atom;
    if (!plus || !minus) add(PairPart::smooth, i);
    if (plus || minus) add(PairPart::atoms, i);
  }
  for (Part& part : parts_) {
    for (double& c : part.cumulative) c /= part.mass;
  }
}

GateSet::GateSet(GateShape shape, std::vector<double> centers)
    : shape_(std::move(shape)), centers_(std::move(centers)), sorted_(centers_.size()), order_(centers_.size()) {
  if (centers_.empty()) throw InputError("a gate needs at least one centre");
  for (const double c : centers_) {
    if (!std::isfinite(c)) throw InputError("gate centres must be finite");
  }
  std::iota(order_.begin(), order_.end(), 0);
  std::stable_sort(order_.begin(), order_.end(), [this](int a, int b) { return centers_[a] < centers_[b]; });
  for (std::size_t i = 0; i < order_.size(); ++i) sorted_[i] = centers_[order_[i]];
  lower_ = shape_.is_steady() ? 0 : sorted_.front() + shape_.lower();
  upper_ = sorted_.back() + shape_.upper();
  sorted_.insert(sorted_.end(), kBlock, sorted_.back());
}

double GateSet::relative_width() const {
  double sum = 0;
  for (double center : centers_) sum += center;
  return shape_.width() * size() / sum;
}

double GateSet::relative_coverage() const {
  if (shape_.is_steady()) return relative_width();
  const double apart = (sorted_.back() - sorted_.front()) / shape_.width();  // in widths of one gate
  return relative_width() * std::min(1 + apart, static_cast<double>(size()));
}

}  // namespace isochron
