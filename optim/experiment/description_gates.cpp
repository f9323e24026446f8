#include <fmt/format.h>

#include <algorithm>

#include "core/base/error.h"
#include "optim/experiment/experiment_reader.h"
#include "optim/experiment/number_file.h"

namespace isochron {
namespace {

constexpr double kSpeedOfLight = 299792458;  // m/s
constexpr int kMostGates = 100000;
const std::vector<std::string> kGateKinds = {"steady", "gaussian", "boxcar", "truncated_gaussian", "tabulated"};

std::vector<double> read_centers(const YamlValue& value) {
  std::vector<double> centers;
  if (value.is_map()) {
    YamlMap map = value.map();
    const double start = map.require("start").number(NumberRange::non_negative());
    const YamlValue stop_value = map.require("stop");
    const double stop = stop_value.number(NumberRange::non_negative());
    const int count = static_cast<int>(map.require("count").integer(1, kMostGates));
    map.reject_unknown();
    if (stop < start) stop_value.fail(fmt::format("{} lies before start", stop), fmt::format("at least {}", start));
    for (int i = 0; i < count; ++i) centers.push_back(count == 1 ? start : start + (stop - start) * i / (count - 1));
    return centers;
  }
  if (!value.is_list()) value.fail("is neither", "a list of numbers, or {start, stop, count}");
  centers = value.numbers(NumberRange::non_negative());
  if (centers.empty()) value.fail("holds no gate", "at least one number");
  return centers;
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

/// A misplaced key gets its kind named.
void explain_keys_of_other_kinds(GateKind kind, YamlMap& map) {
  const std::string name = kGateKinds[static_cast<int>(kind)];
  map.explain("sigma", "belongs to gaussian and truncated_gaussian, not to " + name);
  map.explain("width", "belongs to boxcar, not to " + name);
  map.explain("half_width", "belongs to truncated_gaussian, not to " + name);
  for (const char* key : {"file", "offsets", "values"}) map.explain(key, "belongs to tabulated, not to " + name);
  map.explain("centers", "belongs to every kind but steady");
}

}  // namespace

std::string existing_file(const YamlValue& value, const InputFolder& folder) {
  const std::string text = value.text();
  std::error_code none;  // such as of names that are too long
  const std::filesystem::path path = std::filesystem::weakly_canonical(folder.path / text, none);
  if (none || !std::filesystem::is_regular_file(path, none))
    value.fail("there is no file " + quote(text), "a path relative to the experiment file");
  return path.string();
}

std::vector<std::vector<double>> read_numbers(const YamlValue& value, InputFolder& folder, int columns) {
  folder.number_files.push_back(existing_file(value, folder));
  return read_number_file(folder.number_files.back(), columns);
}

GateSpec read_gates(const YamlValue& value, InputFolder& folder) {
  YamlMap map = value.map();
  GateSpec gates;
  gates.kind = static_cast<GateKind>(map.require("kind").choice(kGateKinds));
  if (const auto unit = map.find("unit")) gates.unit = static_cast<LengthUnit>(unit->choice({"scene", "ns", "ps"}));
  if (gates.unit != LengthUnit::scene)
    gates.scene_unit_m = map.require("scene_unit_m").number(NumberRange::positive());
  else if (const auto metres = map.find("scene_unit_m"))
    gates.scene_unit_m = metres->number(NumberRange::positive());
  if (gates.kind != GateKind::steady) gates.centers = read_centers(map.require("centers"));
  const auto positive = [&](const char* key) { return map.require(key).number(NumberRange::positive()); };
  if (gates.kind == GateKind::gaussian || gates.kind == GateKind::truncated_gaussian) gates.sigma = positive("sigma");
  if (gates.kind == GateKind::boxcar) gates.width = positive("width");
  if (gates.kind == GateKind::truncated_gaussian) gates.half_width = positive("half_width");
  if (gates.kind == GateKind::tabulated) {
    if (const auto file = map.find("file")) {
      for (const auto& row : read_numbers(*file, folder, 2)) {
        gates.offsets.push_back(row[0]);
        gates.values.push_back(row[1]);
      }
    } else {
      gates.offsets = map.require("offsets").numbers();
      const YamlValue values = map.require("values");
      gates.values = values.numbers();
      if (gates.values.size() != gates.offsets.size())
        values.fail(fmt::format("{} values are given", gates.values.size()),
                    fmt::format("one for each of the {} offsets", gates.offsets.size()));
    }
    const bool sorted = std::is_sorted(gates.offsets.begin(), gates.offsets.end());
    const bool positive_values =
        std::all_of(gates.values.begin(), gates.values.end(), [](double v) { return v >= 0; }) &&
        std::any_of(gates.values.begin(), gates.values.end(), [](double v) { return v > 0; });
    if (gates.offsets.size() < 2 || !sorted || !(gates.offsets.front() < gates.offsets.back()) || !positive_values)
      value.fail("the table is no gate",
                 "two rows or more, offsets in rising order, values at least 0 and one of them above");
  }
  explain_keys_of_other_kinds(gates.kind, map);
  map.reject_unknown();
  try {
    require_resolved(make_gates(gates), value);
  } catch (const InputError&) {
    throw;
  } catch (const std::exception& error) {
    value.fail(error.what());
  }
  return gates;
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
