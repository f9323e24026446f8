#include "core/gates/gate.h"

#include <cmath>
#include <numeric>
#include <string>

#include "core/base/error.h"

namespace isochron {
namespace {

/// Largest double below one: where a quantile is inverted, one itself would mean infinity.
constexpr double kBelowOne = 1 - 0x1p-53;

}  // namespace

void GateShape::require_positive(double value, const char* name) {
  if (!(value > 0 && std::isfinite(value))) throw InputError(std::string(name) + " must be positive and finite");
}

double GateShape::sample(double u, double v) const {
  if (is_gaussian_inside()) {
    // Both halves of the law are read from the lower tail, where its distribution function is accurate.
    const bool upper_half = u > 0.5;
    const double tail = outside_ + (upper_half ? 1 - u : u) * mass_;
    const double x = sigma_ * normal_quantile_lower(tail, -std::abs(u - 0.5) * mass_);
    return std::clamp(upper_half ? -x : x, lower_, upper_);
  }
  if (kind_ == GateKind::tabulated) return table_.quantile(u);
  if (kind_ == GateKind::bin) return begin_ + v * (end_ - begin_) - table_.quantile(u);
  return lower_ + u * (upper_ - lower_);
}

double GateShape::quantile(const Side& side, double u) const {
  switch (side.form) {
    case Side::Form::uniform:
      return side.from + u * (side.to - side.from);
    case Side::Form::rayleigh:
      return side.from * std::sqrt(-2 * std::log1p(-u * side.to));
    case Side::Form::delayed:
      return side.from - table_.quantile(u);
    case Side::Form::dirac:
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
  pair.plus_is_jump = segment.plus.form == Side::Form::dirac;
  pair.minus_is_jump = segment.minus.form == Side::Form::dirac;
  pair.has_plus = pair.plus_is_jump == (part == PairPart::dirac);
  pair.has_minus = pair.minus_is_jump == (part == PairPart::dirac);
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
    const bool plus = segments_[i].plus.form == Side::Form::dirac;
    const bool minus = segments_[i].minus.form == Side::Form::dirac;
    if (!plus || !minus) add(PairPart::smooth, i);
    if (plus || minus) add(PairPart::dirac, i);
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
  in_order_ = std::is_sorted(order_.begin(), order_.end());
  lower_ = shape_.is_unbounded() ? 0 : sorted_.front() + shape_.lower();
  upper_ = sorted_.back() + shape_.upper();
  if (shape_.kind() == GateKind::bin) {
    constexpr double kSameEdge = 1e-9;  // of a bin's width
    const double width = shape_.end() - shape_.begin();
    const auto apart = [&](double a, double b) { return !(std::abs(b - a - width) <= kSameEdge * width); };
    contiguous_ = std::adjacent_find(sorted_.begin(), sorted_.end(), apart) == sorted_.end();
    if (contiguous_ && in_order_) bins_ = BinTable(shape_.response(), width);
    bins_per_length_ = 1 / width;
  }
  sorted_.insert(sorted_.end(), kRun, sorted_.back());
}

GateSet GateSet::shifted(double by) const {
  std::vector<double> moved = centers_;
  for (double& center : moved) center += by;
  return GateSet(shape_, moved);
}

double GateSet::relative_width() const {
  double sum = 0;
  for (double center : centers_) sum += std::max(center, 0.0);
  return shape_.width() * size() / sum;
}

double GateSet::relative_coverage() const {
  if (shape_.is_unbounded() || shape_.is_dirac()) return relative_width();
  const double apart = (sorted_.back() - sorted_.front()) / shape_.width();  // in widths of one gate
  return relative_width() * std::min(1 + apart, static_cast<double>(size()));
}

}  // namespace isochron
