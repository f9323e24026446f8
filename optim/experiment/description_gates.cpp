#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

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
  gates.shape->check(value);
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

void GateSpec::choose(const std::string& other_kind) {
  for (const GateKindEntry* each : gate_kinds())
    if (other_kind == each->name) {
      kind = each->name;
      shape = each->make();
      return;
    }
  throw std::logic_error("no kind of gate: " + other_kind);
}

void describe(Keys& keys, GateSpec& gates, ExperimentFolder& folder) {
  std::vector<Keys::Kind> kinds;
  for (const GateKindEntry* each : gate_kinds()) kinds.push_back({each->name, each->meaning});
  const ReadNumbers read_numbers = [&folder](const YamlValue& value, std::size_t columns) {
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
  const Only not_steady{!gates.steady(), "every kind but steady", ""};
  keys.value("centers", centers(gates.centers),
             "one per gate: lengths of whole paths, camera and light segments included",
             {.required = true, .only = not_steady, .unit = "`unit`"});
  keys.value("unit", field::choice(gates.unit), "of all lengths here; of a time, how far light travels in it");
  const bool timed = gates.unit != LengthUnit::scene;
  keys.value(
      "scene_unit_m", field::positive(gates.scene_unit_m), "how long a scene unit is",
      {.required = timed, .unit = "metres", .unset = gates.scene_unit_m == 0, .otherwise = "required for ns, ps"});
  keys.check([&](const YamlValue& value) { check_gates(gates, value); });
}

double length_unit(const GateSpec& spec) {
  if (spec.unit == LengthUnit::scene) return 1;
  return kSpeedOfLight * (spec.unit == LengthUnit::ns ? 1e-9 : 1e-12) / spec.scene_unit_m;
}

GateSet make_gates(const GateSpec& spec) {
  const double unit = length_unit(spec);
  const GateShape shape = spec.shape->shape(unit);
  if (shape.is_steady()) return GateSet(shape, {0.0});
  std::vector<double> centers = spec.centers;
  for (double& center : centers) center *= unit;
  return GateSet(shape, centers);
}

}  // namespace isochron
