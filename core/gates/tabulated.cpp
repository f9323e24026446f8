// The tabulated gate: checks, normalisation, and the quantile coupling of its derivative measure.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/base/error.h"
#include "core/gates/gate_description.h"

namespace isochron {
namespace {

void check_table(const std::vector<double>& offsets, const std::vector<double>& values) {
  if (offsets.size() != values.size()) throw InputError("a gate's table needs as many values as offsets");
  if (offsets.size() < 2) throw InputError("a gate's table needs at least two points");
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const std::string row = "row " + std::to_string(i + 1) + " of the gate's table: ";
    if (!std::isfinite(offsets[i]) || !std::isfinite(values[i])) throw InputError(row + "not finite");
    if (values[i] < 0) throw InputError(row + "negative value");
    if (i > 0 && offsets[i] < offsets[i - 1]) throw InputError(row + "offset below the one before");
  }
}

class Tabulated final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers& read_numbers) override {
    const auto read = [this, &read_numbers](const YamlValue& value) {
      for (const auto& row : read_numbers(value, 2)) {
        offsets_.push_back(row[0]);
        values_.push_back(row[1]);
      }
    };
    const Field table{"text file", "rows of an offset and a value", read, [] { return std::string(); }};
    const bool from_file =
        keys.value("file", table, "in place of `offsets` and `values`", {.unit = "`unit`", .unset = true});
    const Only in_line = from_file ? Only{false, "tables without a file"} : Only{};
    keys.value("offsets", field::numbers(offsets_), "from the centre, rising; an offset given twice is a jump",
               {.required = true, .only = in_line, .unit = "`unit`"});
    const auto same_count = [this](const YamlValue& value) {
      if (values_.size() != offsets_.size())
        value.fail(fmt::format("{} values are given", values_.size()),
                   fmt::format("one for each of the {} offsets", offsets_.size()));
    };
    keys.value("values", field::checked(field::numbers(values_), same_count),
               "one per offset, at least 0; scaled to an integral of 1", {.required = true, .only = in_line});
  }
  void check(const YamlValue& gates) const override {
    const bool sorted = std::is_sorted(offsets_.begin(), offsets_.end());
    const bool positive = std::all_of(values_.begin(), values_.end(), [](double v) { return v >= 0; }) &&
                          std::any_of(values_.begin(), values_.end(), [](double v) { return v > 0; });
    if (offsets_.size() < 2 || !sorted || !(offsets_.front() < offsets_.back()) || !positive)
      gates.fail("the table is no gate",
                 "two rows or more, offsets in rising order, values at least 0 and one of them above");
  }
  GateShape shape(double unit) const override {
    std::vector<double> scaled = offsets_;
    for (double& offset : scaled) offset *= unit;
    return GateShape::tabulated(scaled, values_);
  }
  std::shared_ptr<GateDescription> stretched(double factor) const override {
    auto copy = std::make_shared<Tabulated>(*this);
    for (double& offset : copy->offsets_) offset *= factor;
    return copy;
  }

 private:
  std::vector<double> offsets_, values_;
};

}  // namespace

GateShape GateShape::tabulated(std::vector<double> offsets, std::vector<double> values) {
  check_table(offsets, values);
  GateShape shape;
  shape.kind_ = GateKind::tabulated;
  // Of several points at one offset only the first and the last matter: the limits from either side.
  for (std::size_t i = 0; i < offsets.size(); ++i) {
    const bool inside = i > 0 && i + 1 < offsets.size() && offsets[i] == offsets[i - 1] && offsets[i] == offsets[i + 1];
    if (inside) continue;
    shape.offsets_.push_back(offsets[i]);
    shape.values_.push_back(values[i]);
  }
  // A jump at the very ends is one from or to zero: the outer limit of a repeated end has no effect.
  if (shape.offsets_[0] == shape.offsets_[1]) {
    shape.offsets_.erase(shape.offsets_.begin());
    shape.values_.erase(shape.values_.begin());
  }
  std::size_t n = shape.offsets_.size();
  if (n > 1 && shape.offsets_[n - 1] == shape.offsets_[n - 2]) {
    shape.offsets_.pop_back();
    shape.values_.pop_back();
    --n;
  }
  if (n < 2) throw InputError("a gate's table needs at least two different offsets");
  shape.index_table();
  shape.couple_table();
  shape.finish_parts();
  return shape;
}

void GateShape::index_table() {
  const int n = static_cast<int>(offsets_.size());
  lower_ = offsets_.front();
  upper_ = offsets_.back();
  last_interval_ = n - 2;

  cumulative_.assign(n, 0.0);
  const auto integrate = [this, n] {
    for (int i = 0; i + 1 < n; ++i) {
      cumulative_[i + 1] = cumulative_[i] + 0.5 * (values_[i] + values_[i + 1]) * (offsets_[i + 1] - offsets_[i]);
    }
    return cumulative_.back();
  };
  const double area = integrate();
  if (!(area > 0 && std::isfinite(area))) throw InputError("a gate's table must enclose a positive, finite area");
  for (double& v : values_) v /= area;
  integrate();
  slopes_.assign(n, 0.0);
  for (int i = 0; i <= last_interval_; ++i) {
    if (offsets_[i] < offsets_[i + 1]) slopes_[i] = (values_[i + 1] - values_[i]) / (offsets_[i + 1] - offsets_[i]);
  }

  // Mean and variance by Simpson's rule, exact for the cubics at hand; lengths relative to the middle.
  const double middle = lower_ + 0.5 * (upper_ - lower_);
  const auto moment = [&](double about, int power) {
    double sum = 0;
    const auto f = [&](double x, double w) { return w * std::pow(x - about, power); };
    for (int i = 0; i + 1 < n; ++i) {
      const double a = offsets_[i], b = offsets_[i + 1];
      sum += (b - a) / 6 *
             (f(a, values_[i]) + f(b, values_[i + 1]) + 4 * f(a + 0.5 * (b - a), 0.5 * (values_[i] + values_[i + 1])));
    }
    return sum;
  };
  width_ = std::sqrt(moment(middle + moment(middle, 1), 2));

  const int buckets = n - 1;
  bucket_scale_ = buckets / (upper_ - lower_);
  // Knots and lengths are put into buckets by the same expression, so rounding cannot separate them.
  guide_.resize(buckets + 1);
  int knot = 0;
  for (int b = 0; b < buckets; ++b) {
    while (knot < n && static_cast<int>((offsets_[knot] - lower_) * bucket_scale_) < b) ++knot;
    guide_[b] = knot;
  }
  guide_[buckets] = n;
}

void GateShape::couple_table() {
  std::vector<Piece> plus, minus;
  const auto add = [&](double change, const Side& side) {
    if (change > 0) plus.push_back({change, side});
    if (change < 0) minus.push_back({-change, side});
  };
  add(values_.front(), {Side::Form::dirac, lower_, 0});
  for (int i = 0; i <= last_interval_; ++i) {
    const bool jump = offsets_[i] == offsets_[i + 1];
    const Side side{jump ? Side::Form::dirac : Side::Form::uniform, offsets_[i], offsets_[i + 1]};
    add(values_[i + 1] - values_[i], side);
  }
  add(-values_.back(), {Side::Form::dirac, upper_, 0});
  couple_quantiles(plus, minus);
}

void GateShape::couple_quantiles(const std::vector<Piece>& plus, const std::vector<Piece>& minus) {
  const auto fractions = [](const std::vector<Piece>& pieces, double& total) {
    std::vector<double> ends;
    total = 0;
    for (const Piece& p : pieces) ends.push_back(total += p.mass);
    for (double& e : ends) e /= total;
    return ends;
  };
  double mass = 0, minus_mass = 0;
  const std::vector<double> plus_ends = fractions(plus, mass), minus_ends = fractions(minus, minus_mass);
  // Breakpoints of the two sides that are equal but for rounding count as one.
  const double tolerance = 4 * std::numeric_limits<double>::epsilon() * static_cast<double>(plus.size() + minus.size());

  const auto stretch = [](const Side& side, double start, double end, double from, double to) {
    if (side.form != Side::Form::uniform) return side;
    const double scale = 1 / (end - start);
    return Side{side.form, quantile(side, std::max(from - start, 0.0) * scale),
                quantile(side, std::min((to - start) * scale, 1.0))};
  };
  double at = 0, plus_start = 0, minus_start = 0;
  for (std::size_t i = 0, j = 0; i < plus.size() && j < minus.size();) {
    const double plus_end = plus_ends[i], minus_end = minus_ends[j];
    const bool together = std::abs(plus_end - minus_end) <= tolerance;
    const double next = together ? std::max(plus_end, minus_end) : std::min(plus_end, minus_end);
    if (next > at) {
      segments_.push_back({(next - at) * mass, stretch(plus[i].side, plus_start, plus_end, at, next),
                           stretch(minus[j].side, minus_start, minus_end, at, next)});
      at = next;
    }
    if (together || plus_end < minus_end) {
      ++i;
      plus_start = plus_end;
    }
    if (together || minus_end < plus_end) {
      ++j;
      minus_start = minus_end;
    }
  }
}

extern const GateKindEntry kTabulated;
const GateKindEntry kTabulated{"tabulated", "lines between the rows of a table", make_gate<Tabulated>};

}  // namespace isochron
