#include "core/scene/mesh_file.h"

#include <fmt/format.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <sstream>

#include "core/base/error.h"
#include "core/base/file.h"
#include "core/scene/mesh.h"
#include "core/scene/polygon.h"

namespace isochron {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<>;

/// OpenMesh's importer, except that faces are listed and not linked: linking repeats vertices where faces do
/// not form a manifold, and drops polygons that have a corner twice, parts of polygons, and, silently, faces
/// of vertices that do not exist.
class Importer final : public OpenMesh::IO::ImporterT<HalfEdgeMesh> {
 public:
  explicit Importer(HalfEdgeMesh& vertices) : ImporterT(vertices) {}

  OpenMesh::FaceHandle add_face(const VHandles& polygon) override {
    face_.clear();
    for (const OpenMesh::VertexHandle v : polygon) face_.push_back(v.idx());
    if (has_three_corners(face_)) {
      corners.insert(corners.end(), face_.begin(), face_.end());
      ends.push_back(corners.size());
    }
    return OpenMesh::FaceHandle();  // none to attach colors and the like to
  }

  std::vector<int> corners;       ///< of all polygons
  std::vector<std::size_t> ends;  ///< in `corners`, of each polygon

 private:
  std::vector<int> face_;
};

/// Keeps what OpenMesh prints from the user, who gets one message instead.
class Silence {
 public:
  Silence() : error_(std::cerr.rdbuf(sink_.rdbuf())), log_(std::clog.rdbuf(sink_.rdbuf())) {}
  ~Silence() { std::cerr.rdbuf(error_), std::clog.rdbuf(log_); }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  std::ostringstream sink_;
  std::streambuf *error_, *log_;
};

std::string read_file(const std::string& file) {
  std::string problem;
  std::optional<std::string> contents = read_regular_file(file, problem);
  if (!contents) throw InputError(file + ": " + problem);
  return std::move(*contents);
}

}  // namespace

Mesh read_mesh(const std::string& file) {
  std::string extension = std::filesystem::path(file).extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  if (extension != ".obj" && extension != ".off" && extension != ".ply" && extension != ".stl")
    throw InputError(
        fmt::format("{}: {} is not a kind of mesh (allowed: .obj, .ply, .off, .stl)", file, quote(extension)));
  CheckedMeshFile checked = check_mesh_file(file, extension, read_file(file));
  if (checked.faces == 0) throw InputError(file + ": has no faces");

  HalfEdgeMesh vertices;
  Importer importer(vertices);
  bool read = false;
  {
    const Silence silence;
    std::istringstream stream(std::move(checked.contents));
    OpenMesh::IO::Options options;
    if (checked.binary) options += OpenMesh::IO::Options::Binary;
    read = OpenMesh::IO::IOManager().read(stream, extension, importer, options);
  }
  if (!read || checked.vertices.value_or(vertices.n_vertices()) != vertices.n_vertices() ||
      checked.faces != importer.ends.size()) {
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    throw InputError(fmt::format("{}: cannot be read as {}: OpenMesh finds {} vertices and {} faces there", file,
                                 extension.substr(1), vertices.n_vertices(), importer.ends.size()));
  }

  Mesh mesh;
  mesh.positions.reserve(vertices.n_vertices());
  for (const OpenMesh::VertexHandle v : vertices.vertices()) {
    const OpenMesh::Vec3f& p = vertices.point(v);
    if (!std::isfinite(p[0]) || !std::isfinite(p[1]) || !std::isfinite(p[2]))
      throw InputError(fmt::format("{}: vertex {} has a coordinate that is not a finite number", file, v.idx()));
    mesh.positions.push_back({p[0], p[1], p[2]});
  }
  for (const int v : importer.corners) {
    if (v < 0 || v >= static_cast<int>(mesh.positions.size()))
      throw InputError(fmt::format("{}: there is no vertex {} (0 to {})", file, v, mesh.positions.size() - 1));
  }
  mesh.faces.reserve(importer.ends.size());
  std::vector<int> corners;
  auto begin = importer.corners.begin();
  for (std::size_t f = 0; f < importer.ends.size(); ++f) {
    const auto end = importer.corners.begin() + static_cast<std::ptrdiff_t>(importer.ends[f]);
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
