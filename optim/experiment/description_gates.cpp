#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "core/base/error.h"
#include "optim/experiment/choices.h"
#include "optim/experiment/description.h"

namespace isochron {
namespace {

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

void require_resolved(const GateSet& gates, const YamlValue& value) {
  constexpr double kLeastWidth = 1e-100, kMostWidth = 1e100;
  if (gates.shape().is_unbounded() || gates.shape().is_dirac()) return;
  double longest = 0;
  for (int g = 0; g < gates.size(); ++g) longest = std::max(longest, std::abs(gates.center(g)));
  const double least = std::max(kLeastWidth, kLeastRelativeWidth * longest), width = gates.shape().detail();
  if (width < least)
    value.fail(fmt::format("gates of a standard deviation of {:.3g} scene units are below the rounding of path lengths",
                           width),
               fmt::format("at least {:.3g}, {} of the longest centre", least, kLeastRelativeWidth));
  if (!(width <= kMostWidth)) value.fail(fmt::format("gates are {:.3g} scene units wide", width), "at most 1e100");
}

}  // namespace

void check_gates(const GateSpec& gates, const YamlValue& value) {
  const GateSet set = [&] {
    try {
      return make_gates(gates);
    } catch (const std::exception& error) {
      value.fail(error.what());
    }
  }();
  require_resolved(set, value);
}

void GateSpec::choose(const std::string& other_kind) {
  for (const GateKindEntry* each : gate_kinds())
    if (other_kind == each->name) {
      kind = each->name;
      shape = each->make();
      return;
    }
  throw std::logic_error("no kind of gate: " + other_kind);
}

void GateSpec::set_bins(double start, double width, int count) {
  const double unit_length = length_unit(*this);
  shape = shape->with_bins(start / unit_length, width / unit_length, count);
}

void describe(Keys& keys, GateSpec& gates, ExperimentFolder& folder) {
  std::vector<Keys::Kind> kinds;
  for (const GateKindEntry* each : gate_kinds()) kinds.push_back({each->name, each->meaning});
  const ReadNumbers read_numbers = [&folder](const YamlValue& value, const std::vector<std::string>& columns) {
    return folder.read_numbers(value, columns);
  };
  const auto describe_kind = [&](Keys& inner, const std::string& kind) {
    if (kind == gates.kind) return gates.shape->describe(inner, read_numbers);
    GateSpec other;
    other.choose(kind);
    other.shape->describe(inner, read_numbers);
  };
  keys.kinds(
      "kind", kinds, gates.kind, [&](const std::string& kind) { gates.choose(kind); }, describe_kind,
      "path-length importance: how much light of a length counts");
  const Only placed{gates.shape->has_centers(), "every kind but steady, bins and modulated", ""};
  keys.value("centers", centers(gates.centers),
             "one per gate: lengths of whole paths, camera and light segments included",
             {.required = true, .only = placed, .unit = "`unit`"});
  keys.value("unit", field::choice(gates.unit), "of all lengths here; a time stands for how far light travels in it");
  const bool in_metres = gates.unit != LengthUnit::scene || gates.shape->needs_metres();
  keys.value("scene_unit_m", field::positive(gates.scene_unit_m), "length of a scene unit",
             {.required = in_metres,
              .unit = "metres",
              .unset = gates.scene_unit_m == 0,
              .otherwise = "required for ns, ps, modulated"});
  keys.check([&](const YamlValue& value) {
    gates.shape->check(value);
    if (!gates.needs_bins()) check_gates(gates, value);
  });
}

double length_unit(const GateSpec& spec) {
  if (spec.unit == LengthUnit::scene) return 1;
  return kSpeedOfLight * (spec.unit == LengthUnit::ns ? 1e-9 : 1e-12) / spec.scene_unit_m;
}

GateSet make_gates(const GateSpec& spec) {
  const GateUnits units{length_unit(spec), spec.scene_unit_m};
  const GateShape shape = spec.shape->shape(units);
  if (!spec.shape->has_centers()) return GateSet(shape, spec.shape->own_centers(units));
  std::vector<double> centers = spec.centers;
  for (double& center : centers) center *= units.length;
  return GateSet(shape, centers);
}

GateMarks gate_marks(const GateSpec& spec) {
  GateMarks marks = spec.shape->marks();
  if (spec.shape->has_centers()) marks.numbers = spec.centers;
  if (marks.unit.empty()) marks.unit = name(spec.unit);
  return marks;
}

}  // namespace isochron
