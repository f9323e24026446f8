#include "core/scene/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <filesystem>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/scene/mesh.h"
#include "core/scene/polygon.h"

namespace isochron {
namespace {

PolygonMesh read_polygons(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto read = extension == ".obj"   ? read_obj
                    : extension == ".off" ? read_off
                    : extension == ".ply" ? read_ply
                    : extension == ".stl" ? read_stl
                                          : nullptr;
  if (!read)
    throw InputError(
        fmt::format("{}: {} is not a kind of mesh (allowed: .obj, .ply, .off, .stl)", file, quote(extension)));
  std::string problem;
  const std::optional<std::string> contents = read_regular_file(file, problem);
  if (!contents) throw InputError(file + ": " + problem);
  return read(file, *contents);
}

}  // namespace

void PolygonMesh::add_polygon(const std::vector<int>& polygon) {
  const auto other = std::find_if(polygon.begin(), polygon.end(), [&](int v) { return v != polygon[0]; });
  if (std::none_of(other, polygon.end(), [&](int v) { return v != polygon[0] && v != *other; })) return;
  corners.insert(corners.end(), polygon.begin(), polygon.end());
  ends.push_back(corners.size());
}

Mesh read_mesh(const std::string& file) {
  PolygonMesh polygons = read_polygons(file);
  if (polygons.ends.empty()) throw InputError(file + ": has no faces");
  Mesh mesh;
  mesh.positions = std::move(polygons.positions);
  mesh.faces.reserve(polygons.ends.size());
  std::vector<int> corners;
  auto begin = polygons.corners.begin();
  for (const std::size_t end_index : polygons.ends) {
    const auto end = polygons.corners.begin() + static_cast<std::ptrdiff_t>(end_index);
    corners.assign(begin, end);
    begin = end;
    if (const std::string wrong = cut_polygon(mesh.positions, corners, mesh.faces); !wrong.empty()) {
      const Vec3& first = mesh.positions[corners[0]];
      throw InputError(fmt::format("{}: the face of {} corners that begins at ({:.6g}, {:.6g}, {:.6g}) {}", file,
                                   corners.size(), first.x, first.y, first.z, wrong));
    }
  }
  if (mesh.faces.empty()) throw InputError(file + ": none of its faces has an area");
  return mesh;
}

}  // namespace isochron
