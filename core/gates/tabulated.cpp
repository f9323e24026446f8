// The tabulated gate, and the quantile coupling of its derivative measure.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/base/error.h"
#include "core/gates/gate_description.h"

namespace isochron {
namespace {

class Tabulated final : public GateDescription {
 public:
  void describe(Keys& keys, const ReadNumbers& read_numbers) override {
    const auto read = [this, &read_numbers](const YamlValue& value) {
      for (const auto& row : read_numbers(value, {"offset", "value"})) {
        offsets_.push_back(row[0]);
        values_.push_back(row[1]);
      }
    };
    const Field table{"file of numbers", "rows of an offset and a value", read, [] { return std::string(); }};
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
      gates.fail("the table is not a gate",
                 "two rows or more, offsets in rising order, values at least 0 and one of them above");
  }
  GateShape shape(const GateUnits& units) const override {
    std::vector<double> scaled = offsets_;
    for (double& offset : scaled) offset *= units.length;
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

GateShape GateShape::tabulated(const std::vector<double>& offsets, const std::vector<double>& values) {
  GateShape shape;
  shape.kind_ = GateKind::tabulated;
  shape.table_ = LinearDensity(offsets, values, "gate's table");
  shape.lower_ = shape.table_.lower();
  shape.upper_ = shape.table_.upper();
  shape.width_ = shape.detail_ = shape.table_.deviation();
  shape.couple_table();
  shape.finish_parts();
  return shape;
}

void GateShape::couple_table() {
  std::vector<Piece> plus, minus;
  const auto add = [&](double change, const Side& side) {
    if (change > 0) plus.push_back({change, side});
    if (change < 0) minus.push_back({-change, side});
  };
  const auto& knots = table_.knots();
  add(knots.front().value, {Side::Form::dirac, lower_, 0});
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    const bool jump = knots[i].offset == knots[i + 1].offset;
    const Side side{jump ? Side::Form::dirac : Side::Form::uniform, knots[i].offset, knots[i + 1].offset};
    add(knots[i + 1].value - knots[i].value, side);
  }
  add(-knots.back().value, {Side::Form::dirac, upper_, 0});
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

  const auto stretch = [this](const Side& side, double start, double end, double from, double to) {
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
const GateKindEntry kTabulated{"tabulated", "piecewise linear between the rows of a table", make_gate<Tabulated>};

}  // namespace isochron
