#include "optim/experiment/experiment.h"

#include <fmt/format.h>

#include "core/base/error.h"
#include "optim/experiment/choices.h"
#include "optim/experiment/description.h"

namespace isochron {

const char* name(LengthUnit unit) {
  return unit == LengthUnit::scene ? "scene units" : name_of(unit);
}

ExrNotes exr_notes(const GateSpec& spec) {
  const GateMarks marks = gate_marks(spec);
  return {{"isochron.gateCenters", fmt::format("{}", fmt::join(marks.numbers, " "))},
          {"isochron.gateUnit", marks.unit},
          {"isochron.quantity", spec.unbounded() ? "radiance" : "radiance per scene unit of path length"}};
}

void ParameterSpec::fail(const std::string& key, const std::string& wrong, const std::string& allowed) const {
  for (const std::string& place : {key, std::string()})
    if (const auto found = where.find(place); found != where.end()) found->second.fail(wrong, allowed);
  throw InputError(
      fmt::format("parameter {}: {}: {}{}", name, key, wrong, allowed.empty() ? "" : " (" + allowed + ")"));
}

void SampleSpec::set_all(int n) {
  primal = n;
  for (int* count : {&interior, &visibility, &path_length})
    if (*count > 0) *count = n;
}

const char* program_version() {
  return ISOCHRON_VERSION;
}

namespace {

/// A scene in place of an experiment is a mistake of its own: the keys that are missing would not tell.
void reject_scene(const YamlValue& root) {
  if (!root.is_map()) return;
  YamlMap map = root.map();
  if (map.find("scene") || map.find("gates") || !map.find("camera") || !map.find("shapes")) return;
  const std::string file = std::filesystem::path(root.file()).filename().string();
  root.fail("this is a scene, an experiment is needed",
            fmt::format("a file beside it with scene: {} and gates, such as those in experiments/", file));
}

}  // namespace

Experiment load_experiment(const std::string& file, const std::vector<std::string>& overrides, bool target_values) {
  const YamlValue root = open_yaml(file, overrides);
  reject_scene(root);
  Experiment experiment;
  experiment.file = std::filesystem::absolute(file).string();
  experiment.target.max_bounces = -1;
  ExperimentFolder folder{std::filesystem::absolute(file).parent_path()};
  read_keys(root, [&](Keys& keys) { describe(keys, experiment, folder, target_values); });
  if (experiment.target.max_bounces < 0) experiment.target.max_bounces = experiment.estimator.max_bounces;
  experiment.number_files = folder.number_files;
  return experiment;
}

std::vector<WrittenKey> resolved_keys(Experiment experiment, const std::string& folder) {
  ExperimentFolder base{std::filesystem::weakly_canonical(std::filesystem::absolute(folder))};
  return written_keys([&](Keys& keys) { describe(keys, experiment, base); });
}

std::string resolved_yaml(const Experiment& experiment, const std::string& folder) {
  return fmt::format("version: {}\n", yaml_text(program_version())) + yaml(resolved_keys(experiment, folder));
}

std::string experiment_reference() {
  Experiment experiment;
  ExperimentFolder folder;
  return reference_tables([&](Keys& keys) { describe(keys, experiment, folder); });
}

}  // namespace isochron
