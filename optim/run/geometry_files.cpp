#include "optim/run/geometry_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>

#include "core/base/file.h"
#include "core/base/ranks.h"
#include "core/scene/mesh_writer.h"

namespace isochron {
namespace {

std::string file_name(std::string name) {
  std::replace_if(
      name.begin(), name.end(),
      [](unsigned char c) { return c >= 0x80 || (std::isalnum(c) == 0 && c != '_' && c != '-'); }, '_');
  return name;
}

bool all_known(const Scene& scene, const Shape& shape) {
  const auto first = scene.positions.begin() + shape.first_vertex;
  return std::none_of(first, first + shape.vertex_count,
                      [](const Vec3& p) { return std::isnan(p.x) || std::isnan(p.y) || std::isnan(p.z); });
}

std::vector<VertexProperty> properties(const Scene& scene, const Shape& shape, const std::vector<double>& errors) {
  std::vector<VertexProperty> result;
  const auto add = [&](const char* name, const std::vector<double>& values) {
    const auto first = values.begin() + shape.first_vertex;
    result.push_back({name, {first, first + shape.vertex_count}});
  };
  if (shape.textured) add("albedo", scene.texture);
  if (!errors.empty()) add("standard_error", errors);
  return result;
}

}  // namespace

GeometryFiles::GeometryFiles(const std::string& folder, const OutputSpec& output, const Parameters& parameters)
    : folder_(folder + "/geometry"), output_(output), parameters_(parameters) {
  if (output.geometry == "none") return;
  const Scene& scene = parameters.scene();
  for (const int shape : parameters.moving_shapes()) {
    const std::string stem = file_name(scene.shapes[shape].name);
    std::string name = stem;
    const auto taken = [&] {
      return std::any_of(files_.begin(), files_.end(), [&](const File& file) { return file.name == name; });
    };
    for (int i = 2; taken(); ++i) name = fmt::format("{}_{}", stem, i);
    files_.push_back({shape, name});
  }
  if (!files_.empty()) on_first_rank([&] { std::filesystem::create_directories(folder_); });
}

void GeometryFiles::write(const std::string& moment, const std::vector<double>& theta,
                          const std::vector<double>& errors) const {
  if (files_.empty()) return;
  const auto formats = mesh_formats();
  const MeshFormat& format = *std::find_if(formats.begin(), formats.end(),
                                           [&](const MeshFormat& each) { return output_.geometry == each.name; });
  const Scene scene = parameters_.in_place(theta);
  for (const File& file : files_) {
    const Shape& shape = scene.shapes[file.shape];
    if (!all_known(scene, shape)) continue;
    write_file_atomically(path(moment, file), format.write(scene, shape, properties(scene, shape, errors)));
  }
}

void GeometryFiles::remove(const std::string& moment) const {
  on_first_rank([&] {
    for (const File& file : files_) std::filesystem::remove(path(moment, file));
  });
}

std::string GeometryFiles::path(const std::string& moment, const File& file) const {
  return fmt::format("{}/{}_{}.{}", folder_, moment, file.name, output_.geometry);
}

void GeometryFiles::write_iteration(int iteration, const std::vector<double>& theta) const {
  if (output_.every > 0 && iteration > 0 && iteration % output_.every == 0)
    write(fmt::format("{:06}", iteration), theta);
}

}  // namespace isochron
