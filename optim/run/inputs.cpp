#include "optim/run/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "core/base/description.h"
#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/yaml_reader.h"

namespace isochron {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFolder = "inputs";
constexpr const char* kList = "inputs.yaml";

const FileCopy* find(const std::vector<FileCopy>& inputs, const std::string& original) {
  const auto found =
      std::find_if(inputs.begin(), inputs.end(), [&](const FileCopy& copy) { return copy.original == original; });
  return found == inputs.end() ? nullptr : &*found;
}

}  // namespace

std::vector<FileCopy> collect_inputs(const Experiment& experiment) {
  std::vector<FileCopy> inputs;
  for (FileCopy& copy : copy_of_scene(experiment.scene)) {
    copy.name = "scene/" + copy.name;
    inputs.push_back(std::move(copy));
  }
  inputs.push_back({"", kList, "", ""});  // no other file may take this name
  const auto add = [&](const std::string& file, const std::string& name) {
    if (!find(inputs, file)) inputs.push_back(copy_of_file(file, free_name(name, inputs)));
  };
  add(experiment.file, "experiment.yaml");
  for (const std::string& file : experiment.number_files) add(file, fs::path(file).filename().string());
  for (const std::string& file : {experiment.target.images, experiment.target.capture, experiment.target.mask})
    if (!file.empty()) add(file, fs::path(file).filename().string());
  std::erase_if(inputs, [](const FileCopy& copy) { return copy.original.empty(); });
  return inputs;
}

void write_inputs(const std::string& folder, const std::vector<FileCopy>& inputs, Experiment& experiment) {
  const fs::path place = fs::weakly_canonical(fs::absolute(folder)) / kFolder;
  std::error_code ignored;
  if (fs::exists(place) && !fs::exists(place / kList) && !fs::is_empty(place, ignored))
    throw InputError(fmt::format("{}: is there already and not of a run (allowed: -o for another folder)",
                                 (fs::path(folder) / kFolder).string()));
  std::string list =
      "# What the run began with. Checksums are FNV-1a, 64 bits; that of a scene's copy differs from its original's\n"
      "# where paths in it had to change.\nfiles:\n";
  for (const FileCopy& copy : inputs)
    fmt::format_to(std::back_inserter(list),
                   "  - copy: {}\n    checksum: \"{}\"\n    original: {}\n    original_checksum: \"{}\"\n",
                   yaml_text(copy.name), checksum(copy.contents), yaml_text(copy.original), copy.checksum);
  // The list comes first, as it marks the folder as a run's; experiment.yaml, without which there is no run, comes last.
  fs::create_directories(place);
  write_file_atomically((place / kList).string(), list);
  for (const FileCopy& copy : inputs) {
    const fs::path file = place / copy.name;
    fs::create_directories(file.parent_path());
    write_file_atomically(file.string(), copy.contents);
  }
  experiment.scene = (place / find(inputs, experiment.scene)->name).string();
  for (std::string* file : {&experiment.target.images, &experiment.target.capture, &experiment.target.mask})
    if (!file->empty()) *file = (place / find(inputs, *file)->name).string();
}

void check_inputs(const std::string& folder, const std::function<void(const std::string&)>& warning) {
  const fs::path place = fs::path(folder) / kFolder;
  if (!fs::exists(place / kList)) return;  // of a run that an older version began
  YamlMap list = open_yaml((place / kList).string()).map();
  std::string changed;
  std::string ignored;
  for (const YamlValue& entry : list.require("files").list()) {
    YamlMap file = entry.map();
    const std::string copy = (place / file.require("copy").text()).string();
    const std::string original = file.require("original").text();
    const auto contents = read_regular_file(copy, ignored);
    if (!contents || checksum(*contents) != file.require("checksum").text())
      throw InputError(
          fmt::format("{}: {} since the run began, which cannot go on without it (allowed: to restore it "
                      "from {}, or a new run)",
                      copy, contents ? "has changed" : "has gone", original));
    const auto now = read_regular_file(original, ignored);
    if (now && checksum(*now) != file.require("original_checksum").text())
      changed += (changed.empty() ? "" : ", ") + original;
  }
  if (!changed.empty() && warning)
    warning(fmt::format("changed since the run began: {}; continuing with the copies in {}", changed, place.string()));
}

}  // namespace isochron
