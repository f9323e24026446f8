#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"
#include "optim/experiment/choices.h"
#include "optim/experiment/description.h"

namespace isochron {
namespace {

constexpr double kSpeedOfLight = 299792458;  // m/s
constexpr int kMostGates = 100000;

/// A list of numbers, or {start, stop, count}.
Field centers(std::vector<double>& variable) {
  const auto read = [&variable](const YamlValue& value) {
    if (value.is_map()) {
      YamlMap map = value.map();
      const double start = map.require("start").number(NumberRange::non_negative());
      const YamlValue stop_value = map.require("stop");
      const double stop = stop_value.number(NumberRange::non_negative());
      const int count = static_cast<int>(map.require("count").integer(1, kMostGates));
      map.reject_unknown();
      if (stop < start) stop_value.fail(fmt::format("{} lies before start", stop), fmt::format("at least {}", start));
      variable.clear();
      for (int i = 0; i < count; ++i) variable.push_back(count == 1 ? start : start + (stop - start) * i / (count - 1));
      return;
    }
    if (!value.is_list()) value.fail("is neither", "a list of numbers, or {start, stop, count}");
    variable = value.numbers(NumberRange::non_negative());
    if (variable.empty()) value.fail("holds no gate", "at least one number");
  };
  return {"list of numbers, or {start, stop, count}", "at least 0", read, [&variable] { return yaml_list(variable); }};
}

/// Rows of an offset and a value.
Field table(GateSpec& gates, ExperimentFolder& folder) {
  const auto read = [&](const YamlValue& value) {
    for (const auto& row : folder.read_numbers(value, 2)) {
      gates.offsets.push_back(row[0]);
      gates.values.push_back(row[1]);
    }
  };
  return {"text file", "rows of an offset and a value", read, [] { return std::string(); }};
}

void check_table(const GateSpec& gates, const YamlValue& value) {
  const bool sorted = std::is_sorted(gates.offsets.begin(), gates.offsets.end());
  const bool positive = std::all_of(gates.values.begin(), gates.values.end(), [](double v) { return v >= 0; }) &&
                        std::any_of(gates.values.begin(), gates.values.end(), [](double v) { return v > 0; });
  if (gates.offsets.size() < 2 || !sorted || !(gates.offsets.front() < gates.offsets.back()) || !positive)
    value.fail("the table is no gate",
               "two rows or more, offsets in rising order, values at least 0 and one of them above");
}

/// Path lengths are sums of doubles, each rounded to 1e-16 of itself, over thousands of segments at most: narrower gates
/// see nothing but rounding, and in the end their peaks overflow.
void require_resolved(const GateSet& gates, const YamlValue& value) {
  constexpr double kLeastRelativeWidth = 1e-12, kLeastWidth = 1e-100, kMostWidth = 1e100;
  if (gates.shape().is_steady()) return;
  double longest = 0;
  for (int g = 0; g < gates.size(); ++g) longest = std::max(longest, gates.center(g));
  const double least = std::max(kLeastWidth, kLeastRelativeWidth * longest), width = gates.shape().width();
  if (width < least)
    value.fail(fmt::format("gates of a standard deviation of {:.3g} scene units cannot be told from rounding", width),
               fmt::format("at least {:.3g}, {} of the longest centre", least, kLeastRelativeWidth));
  if (!(width <= kMostWidth)) value.fail(fmt::format("gates are {:.3g} scene units wide", width), "at most 1e100");
}

void check_gates(const GateSpec& gates, const YamlValue& value) {
  if (gates.kind == GateKind::tabulated) check_table(gates, value);
  const GateSet set = [&] {
    try {
      return make_gates(gates);
    } catch (const std::exception& error) {
      value.fail(error.what());
    }
  }();
  require_resolved(set, value);
}

}  // namespace

void describe(Keys& keys, GateSpec& gates, ExperimentFolder& folder) {
  using enum GateKind;
  const auto of = [&](std::initializer_list<GateKind> kinds) { return only(gates.kind, kinds); };
  keys.value("kind", field::choice(gates.kind), "path-length importance: how much light of a length counts",
             {.required = true});
  keys.value("unit", field::choice(gates.unit), "of all lengths here; of a time, how far light travels in it");
  const bool timed = gates.unit != LengthUnit::scene;
  keys.value(
      "scene_unit_m", field::positive(gates.scene_unit_m), "how long a scene unit is",
      {.required = timed, .unit = "metres", .unset = gates.scene_unit_m == 0, .otherwise = "required for ns, ps"});
  keys.value("centers", centers(gates.centers),
             "one per gate: lengths of whole paths, camera and light segments included",
             {.required = true, .only = {gates.kind != steady, "every kind but steady"}, .unit = "`unit`"});
  keys.value("sigma", field::positive(gates.sigma), "standard deviation",
             {.required = true, .only = of({gaussian, truncated_gaussian}), .unit = "`unit`"});
  keys.value("width", field::positive(gates.width), "from end to end",
             {.required = true, .only = of({boxcar}), .unit = "`unit`"});
  keys.value("half_width", field::positive(gates.half_width), "from the centre to either end",
             {.required = true, .only = of({truncated_gaussian}), .unit = "`unit`"});
  const bool from_file = keys.value("file", table(gates, folder), "in place of `offsets` and `values`",
                                    {.only = of({tabulated}), .unit = "`unit`", .unset = true});
  const Only in_line = from_file ? Only{false, "tables without a file"} : of({tabulated});
  keys.value("offsets", field::numbers(gates.offsets), "from the centre, rising; an offset given twice is a jump",
             {.required = true, .only = in_line, .unit = "`unit`"});
  const auto same_count = [&](const YamlValue& value) {
    if (gates.values.size() != gates.offsets.size())
      value.fail(fmt::format("{} values are given", gates.values.size()),
                 fmt::format("one for each of the {} offsets", gates.offsets.size()));
  };
  keys.value("values", field::checked(field::numbers(gates.values), same_count),
             "one per offset, at least 0; scaled to an integral of 1", {.required = true, .only = in_line});
  keys.check([&](const YamlValue& value) { check_gates(gates, value); });
}

double length_unit(const GateSpec& spec) {
  if (spec.unit == LengthUnit::scene) return 1;
  return kSpeedOfLight * (spec.unit == LengthUnit::ns ? 1e-9 : 1e-12) / spec.scene_unit_m;
}

GateSet make_gates(const GateSpec& spec) {
  if (spec.kind == GateKind::steady) return GateSet(GateShape::steady(), {0.0});
  const double scale = length_unit(spec);
  const auto scaled = [&](std::vector<double> lengths) {
    for (double& length : lengths) length *= scale;
    return lengths;
  };
  const GateShape shape = [&] {
    switch (spec.kind) {
      case GateKind::gaussian:
        return GateShape::gaussian(scale * spec.sigma);
      case GateKind::boxcar:
        return GateShape::boxcar(scale * spec.width);
      case GateKind::truncated_gaussian:
        return GateShape::truncated_gaussian(scale * spec.sigma, scale * spec.half_width);
      default:
        return GateShape::tabulated(scaled(spec.offsets), spec.values);
    }
  }();
  return GateSet(shape, scaled(spec.centers));
}

}  // namespace isochron
