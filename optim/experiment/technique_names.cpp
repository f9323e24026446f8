#include "optim/experiment/technique_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

namespace isochron {
namespace {

struct BoundaryName {
  const char* name;
  const char* meaning;
  bool BoundaryTechniques::*used;
};
constexpr BoundaryName kBoundaryNames[] = {
    {"wedge", "boundary segments by edges and their wedges; else in any direction", &BoundaryTechniques::wedge},
    {"aimed", "boundary segments aimed at emitters", &BoundaryTechniques::aimed},
    {"from_camera", "edges seen from camera paths", &BoundaryTechniques::from_camera},
    {"at_length", "boundary segments at lengths drawn from narrow gates", &BoundaryTechniques::at_length},
    {"light_arcs", "connections beyond boundary segments, where gates are narrow", &BoundaryTechniques::light_arcs},
};

void use_only(const std::set<std::string>& names, const YamlValue& value, EstimatorOptions& options) {
  const bool standard = names.contains("standard"), ellipsoidal = names.contains("ellipsoidal");
  if (!standard && !ellipsoidal) value.fail("leaves no technique that finds paths", "standard, ellipsoidal or both");
  const bool contradicts = (options.sampling == Sampling::standard && !standard) ||
                           (options.sampling == Sampling::ellipsoidal && !ellipsoidal);
  if (contradicts) value.fail("leaves out what `sampling` asks for", "with sampling: auto, any");
  if (!(standard && ellipsoidal)) options.sampling = standard ? Sampling::standard : Sampling::ellipsoidal;
  if (!names.contains("light")) {
    if (options.light.value_or(0) > 0) value.fail("leaves out light subpaths, which `light` asks for");
    options.light = 0;
  }
  for (const BoundaryName& each : kBoundaryNames) options.boundary.*each.used = names.contains(each.name);
}

}  // namespace

std::vector<std::string> used_techniques(const EstimatorOptions& options) {
  std::vector<std::string> names;
  if (options.sampling != Sampling::ellipsoidal) names.emplace_back("standard");
  if (options.sampling != Sampling::standard) names.emplace_back("ellipsoidal");
  if (options.light != 0) names.emplace_back("light");
  for (const BoundaryName& each : kBoundaryNames)
    if (options.boundary.*each.used) names.emplace_back(each.name);
  return names;
}

void leave_out(const std::string& technique, EstimatorOptions& options) {
  if (technique == "standard") options.sampling = Sampling::ellipsoidal;
  if (technique == "ellipsoidal") options.sampling = Sampling::standard;
  if (technique == "light") options.light = 0;
  for (const BoundaryName& each : kBoundaryNames)
    if (technique == each.name) options.boundary.*each.used = false;
}

Field techniques(EstimatorOptions& options) {
  std::vector<std::string> known{"standard", "ellipsoidal", "light"};
  std::string meanings = "`standard`: random walks; `ellipsoidal`: connections; `light`: light subpaths";
  for (const BoundaryName& each : kBoundaryNames) {
    known.emplace_back(each.name);
    meanings += fmt::format("; `{}`: {}", each.name, each.meaning);
  }
  const std::string allowed = fmt::format("{}", fmt::join(known, ", "));
  const auto read = [&options, known, allowed](const YamlValue& value) {
    std::set<std::string> names;
    for (const YamlValue& each : value.list()) {
      const std::string name = each.text();
      if (std::ranges::find(known, name) == known.end())
        each.fail(fmt::format("there is no technique '{}'", name), allowed);
      names.insert(name);
    }
    use_only(names, value, options);
  };
  return {"list of words", allowed, read,
          [&options] { return fmt::format("[{}]", fmt::join(used_techniques(options), ", ")); }, meanings};
}

bool leaves_out_techniques(const EstimatorOptions& options) {
  return options.boundary != BoundaryTechniques{};
}

}  // namespace isochron
