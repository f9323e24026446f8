#include "core/gates/linear_density.h"

#include <cmath>

#include "core/base/error.h"

namespace isochron {
namespace {

void check_table(const std::vector<double>& offsets, const std::vector<double>& values, const std::string& what) {
  if (offsets.size() != values.size()) throw InputError("a " + what + " needs as many values as offsets");
  if (offsets.size() < 2) throw InputError("a " + what + " needs at least two points");
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::string row = "row " + std::to_string(i + 1) + " of the " + what + ": ";
    if (!std::isfinite(offsets[i]) || !std::isfinite(values[i])) throw InputError(row + "not finite");
    if (values[i] < 0) throw InputError(row + "negative value");
    if (i > 0 && offsets[i] < offsets[i - 1]) throw InputError(row + "offset below the one before");
  }
}

}  // namespace

LinearDensity::LinearDensity(const std::vector<double>& offsets, const std::vector<double>& values,
                             const std::string& what) {
  check_table(offsets, values, what);
  // Of several points at one offset only the first and the last matter: the limits from either side.
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const bool inside = i > 0 && i + 1 < offsets.size() && offsets[i] == offsets[i - 1] && offsets[i] == offsets[i + 1];
    if (!inside) knots_.push_back({offsets[i], values[i]});
  }
  // A jump at the very ends is one from or to zero: the outer limit of a repeated end has no effect.
  if (knots_[0].offset == knots_[1].offset) knots_.erase(knots_.begin());
  const std::size_t n = knots_.size();
  if (n > 1 && knots_[n - 1].offset == knots_[n - 2].offset) knots_.pop_back();
  if (knots_.size() < 2) throw InputError("a " + what + " needs at least two different offsets");

  lower_ = knots_.front().offset;
  upper_ = knots_.back().offset;

  const auto integrate = [this] {
    for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
      const Knot &a = knots_[i], &b = knots_[i + 1];
      knots_[i + 1].below = a.below + 0.5 * (a.value + b.value) * (b.offset - a.offset);
    }
    return knots_.back().below;
  };
  const double area = integrate();
  if (!(area > 0 && std::isfinite(area))) throw InputError("a " + what + " must enclose a positive, finite area");
  for (Knot& knot : knots_) knot.value /= area;
  integrate();
  for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
    Knot& a = knots_[i];
    const Knot& b = knots_[i + 1];
    if (a.offset < b.offset) a.slope = (b.value - a.value) / (b.offset - a.offset);
  }

  // Mean and variance by Simpson's rule, exact for the cubics at hand; lengths relative to the middle.
  const double middle = lower() + 0.5 * (upper() - lower());
  const auto moment = [&](double about, int power) {
    double sum = 0;
    const auto f = [&](double x, double w) { return w * std::pow(x - about, power); };
    for (std::size_t i = 0; i + 1 < knots_.size(); ++i) {
      const double a = knots_[i].offset, b = knots_[i + 1].offset, v = knots_[i].value, w = knots_[i + 1].value;
      sum += (b - a) / 6 * (f(a, v) + f(b, w) + 4 * f(a + 0.5 * (b - a), 0.5 * (v + w)));
    }
    return sum;
  };
  deviation_ = std::sqrt(moment(middle + moment(middle, 1), 2));
  index();
}

void LinearDensity::index() {
  const int n = static_cast<int>(knots_.size()), buckets = n - 1;
  last_interval_ = n - 2;
  last_bucket_ = buckets - 1;
  const double step = (upper() - lower()) / buckets;
  bucket_scale_ = buckets / (upper() - lower());
  even_ = true;
  for (int i = 0; i < n; ++i)
    if (std::abs(knots_[i].offset - (lower() + i * step)) > kEven * step) even_ = false;
  if (even_) return;
  // Knots and lengths are put into buckets by the same expression, so rounding cannot separate them.
  guide_.resize(buckets + 1);
  int knot = 0;
  for (int b = 0; b < buckets; ++b) {
    while (knot < n && static_cast<int>((knots_[knot].offset - lower()) * bucket_scale_) < b) ++knot;
    guide_[b] = knot;
  }
  guide_[buckets] = n;
}

double LinearDensity::quantile(double u) const {
  const double target = u * knots_.back().below;
  const auto above = [](double at, const Knot& knot) { return at < knot.below; };
  const auto next = std::upper_bound(knots_.begin(), knots_.end(), target, above);
  const int i = std::min(static_cast<int>(next - knots_.begin()) - 1, last_interval_);
  const Knot& knot = knots_[i];
  const double rest = target - knot.below;
  if (rest <= 0) return knot.offset;
  // Smaller root of v t + slope t^2 / 2 = rest, in the form that does not cancel.
  const double root = std::sqrt(std::max(knot.value * knot.value + 2 * knot.slope * rest, 0.0));
  return std::min(knot.offset + 2 * rest / (knot.value + root), knots_[i + 1].offset);
}

}  // namespace isochron
