#include "core/scene/scene_copy.h"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "core/base/error.h"
#include "core/base/file.h"

namespace isochron {
namespace {

namespace fs = std::filesystem;

/// As `text`, in a scene file, means it.
std::string path_of(const std::string& scene_file, const std::string& text) {
  return (fs::path(scene_file).parent_path() / text).lexically_normal().string();
}

std::string rewritten(const YAML::Node& scene, const char* why) {
  YAML::Emitter text;
  text << scene;
  return fmt::format("# Rewritten, as {}.\n{}\n", why, text.c_str());
}

bool lies_below(const fs::path& relative) {
  return relative.is_relative() && !relative.empty() && *relative.begin() != "..";
}

}  // namespace

FileCopy copy_of_file(const std::string& original, const std::string& name) {
  std::string problem;
  std::optional<std::string> contents = read_regular_file(original, problem);
  if (!contents) throw InputError(original + ": " + problem);
  std::string sum = checksum(*contents);
  return {original, name, std::move(*contents), std::move(sum)};
}

std::string free_name(const std::string& name, const std::vector<FileCopy>& taken) {
  const fs::path path(name);
  std::string candidate = name;
  for (int i = 2; std::any_of(taken.begin(), taken.end(), [&](const FileCopy& f) { return f.name == candidate; }); ++i)
    candidate =
        (path.parent_path() / fmt::format("{}_{}{}", path.stem().string(), i, path.extension().string())).string();
  return candidate;
}

std::vector<FileCopy> copy_of_scene(const std::string& file) {
  std::vector<FileCopy> copies{copy_of_file(file, fs::path(file).filename().string())};
  YAML::Node scene = YAML::Load(copies[0].contents);
  bool changed = false;
  const auto copy_file_of = [&](YAML::Node owner) {
    const std::string text = owner["file"].Scalar();
    const std::string original = path_of(file, text);
    const auto known =
        std::find_if(copies.begin() + 1, copies.end(), [&](const FileCopy& copy) { return copy.original == original; });
    const fs::path normal = fs::path(text).lexically_normal();
    std::string name;
    if (known != copies.end()) {
      name = known->name;
    } else {
      name = lies_below(normal) ? normal.string() : "elsewhere/" + fs::path(original).filename().string();
      name = free_name(name, copies);
      copies.push_back(copy_of_file(original, name));
    }
    if (name == normal) return;
    owner["file"] = name;
    changed = true;
  };
  for (YAML::Node shape : scene["shapes"]) copy_file_of(shape);
  if (scene["capture"] && scene["capture"]["file"]) copy_file_of(scene["capture"]);
  if (changed) copies[0].contents = rewritten(scene, "its files have moved");
  return copies;
}

std::string scene_with_mesh(const std::string& file, const std::string& shape, const std::string& mesh,
                            const std::string& folder) {
  YAML::Node scene = YAML::Load(copy_of_file(file, "").contents);
  const auto relative = [&](const std::string& path) {
    return fs::path(path).lexically_proximate(fs::path(folder)).string();
  };
  for (YAML::Node each : scene["shapes"]) {
    const bool replaced = each["name"].Scalar() == shape;
    each["file"] = relative(replaced ? mesh : path_of(file, each["file"].Scalar()));
    if (replaced) each.remove("transform");
  }
  if (YAML::Node capture = scene["capture"]; capture && capture["file"])
    capture["file"] = relative(path_of(file, capture["file"].Scalar()));
  return rewritten(scene, "a mesh is another one");
}

}  // namespace isochron
