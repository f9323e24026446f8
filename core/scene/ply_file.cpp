#include <fmt/format.h>

#include <OpenMesh/Core/IO/MeshIO.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <cmath>
#include <iostream>
#include <limits>
#include <sstream>

#include "core/math/error.h"
#include "core/scene/mesh_file.h"

namespace isochron {
namespace {

using namespace OpenMesh;  // for the many types of the importer's interface

/// Collects vertices and faces as they stand in the file. OpenMesh's own importer builds half-edges and
/// changes what is not a manifold before seams are welded.
class Collector final : public IO::BaseImporter {
 public:
  explicit Collector(Mesh& mesh) : mesh_(mesh) {}

  VertexHandle add_vertex(const Vec3f& p) override {
    mesh_.positions.push_back({p[0], p[1], p[2]});
    return VertexHandle(static_cast<int>(mesh_.positions.size()) - 1);
  }
  VertexHandle add_vertex(const Vec3d& p) override {
    mesh_.positions.push_back({p[0], p[1], p[2]});
    return VertexHandle(static_cast<int>(mesh_.positions.size()) - 1);
  }
  VertexHandle add_vertex() override { return add_vertex(Vec3f(0, 0, 0)); }
  void set_point(VertexHandle v, const Vec3f& p) override {
    mesh_.positions.at(v.idx()) = {p[0], p[1], p[2]};
  }
  FaceHandle add_face(const VHandles& corners) override {
    polygon_.clear();
    for (const VertexHandle v : corners) polygon_.push_back(v.idx());
    add_polygon(polygon_, mesh_);
    return FaceHandle(faces_++);
  }
  size_t n_vertices() const override { return mesh_.positions.size(); }
  size_t n_faces() const override { return static_cast<size_t>(faces_); }
  size_t n_edges() const override { return 0; }

  // Everything else a file can hold does not matter here.
  using E = EdgeHandle;
  using F = FaceHandle;
  using H = HalfedgeHandle;
  using V = VertexHandle;
  using Status = Attributes::StatusInfo;
  H add_edge(V, V) override { return H(); }
  F add_face(H) override { return F(); }
  void add_face_texcoords(F, V, const std::vector<Vec2f>&) override {}
  void add_face_texcoords(F, V, const std::vector<Vec3f>&) override {}
  void set_face_texindex(F, int) override {}
  void set_halfedge(V, H) override {}
  void set_next(H, H) override {}
  void set_face(H, F) override {}
  void set_normal(V, const Vec3f&) override {}
  void set_normal(V, const Vec3d&) override {}
  void set_normal(F, const Vec3f&) override {}
  void set_normal(F, const Vec3d&) override {}
  void set_color(V, const Vec3uc&) override {}
  void set_color(V, const Vec4uc&) override {}
  void set_color(V, const Vec3f&) override {}
  void set_color(V, const Vec4f&) override {}
  void set_color(E, const Vec3uc&) override {}
  void set_color(E, const Vec4uc&) override {}
  void set_color(E, const Vec3f&) override {}
  void set_color(E, const Vec4f&) override {}
  void set_color(F, const Vec3uc&) override {}
  void set_color(F, const Vec4uc&) override {}
  void set_color(F, const Vec3f&) override {}
  void set_color(F, const Vec4f&) override {}
  void set_texcoord(V, const Vec2f&) override {}
  void set_texcoord(V, const Vec3f&) override {}
  void set_texcoord(H, const Vec2f&) override {}
  void set_texcoord(H, const Vec3f&) override {}
  void request_face_texcoords2D() override {}
  void set_status(V, const Status&) override {}
  void set_status(H, const Status&) override {}
  void set_status(E, const Status&) override {}
  void set_status(F, const Status&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  Mesh& mesh_;
  std::vector<int> polygon_;
  int faces_ = 0;
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

struct Element {
  std::string name;
  long long count = 0;
  std::vector<std::string> properties;
  std::vector<bool> is_list;

  int find(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i) {
      if (properties[i] == property) return static_cast<int>(i);
    }
    return -1;
  }
};

struct Header {
  bool text = false;
  std::vector<Element> elements;

  const Element* find(std::string_view name) const {
    for (const Element& element : elements) {
      if (element.name == name) return &element;
    }
    return nullptr;
  }
};

Header read_header(LineReader& lines) {
  Header header;
  lines.require_next();
  if (lines.word() != "ply") lines.fail("does not begin with ply");
  bool format = false;
  for (lines.require_next();; lines.require_next()) {
    const std::string_view keyword = lines.word();
    if (keyword == "end_header") break;
    if (keyword == "format") {
      const std::string_view kind = lines.word();
      header.text = kind == "ascii";
      format = header.text || kind == "binary_little_endian" || kind == "binary_big_endian";
      if (!format) lines.fail(fmt::format("'{}' is not a format of PLY", kind));
    } else if (keyword == "element") {
      Element element;
      element.name = lines.word();
      element.count = lines.integer();
      if (element.count < 0 || element.count > std::numeric_limits<int>::max())
        lines.fail("an impossible count");
      header.elements.push_back(element);
    } else if (keyword == "property") {
      if (header.elements.empty()) lines.fail("a property of no element");
      const bool list = lines.word() == "list";
      if (list) lines.word(), lines.word();
      header.elements.back().properties.emplace_back(lines.word());
      header.elements.back().is_list.push_back(list);
    }
  }
  if (!format) lines.fail("the header states no format");
  const Element* vertex = header.find("vertex");
  if (vertex == nullptr || vertex->find("x") < 0 || vertex->find("y") < 0 || vertex->find("z") < 0)
    lines.fail("the header has no element vertex with properties x, y and z");
  const Element* face = header.find("face");
  if (face == nullptr || (face->find("vertex_indices") < 0 && face->find("vertex_index") < 0))
    lines.fail("has no faces (an element face with property vertex_indices)");
  return header;
}

Mesh read_text(LineReader& lines, const Header& header) {
  Mesh mesh;
  const auto vertices = static_cast<std::size_t>(header.find("vertex")->count);
  for (const Element& element : header.elements) {
    const int axes[3] = {element.find("x"), element.find("y"), element.find("z")};
    for (long long i = 0; i < element.count; ++i) {
      lines.require_next();
      Vec3 point;
      for (int p = 0; p < static_cast<int>(element.properties.size()); ++p) {
        const std::string& property = element.properties[p];
        if (!element.is_list[p]) {
          const double value = lines.number();
          for (int axis = 0; axis < 3; ++axis) {
            if (axes[axis] == p) point[axis] = value;
          }
          continue;
        }
        const long long count = lines.integer();
        if (element.name == "face" && (property == "vertex_indices" || property == "vertex_index")) {
          read_indexed_face(lines, count, vertices, mesh);
        } else {
          for (long long k = 0; k < count; ++k) lines.number();
        }
      }
      if (element.name == "vertex") mesh.positions.push_back(point);
    }
  }
  return mesh;
}

Mesh read_binary(const std::string& file, const Header& header) {
  Mesh mesh;
  Collector collector(mesh);
  bool read = false;
  {
    const Silence silence;
    IO::Options options;
    read = IO::IOManager().read(file, collector, options);
  }
  if (!read || static_cast<long long>(collector.n_vertices()) != header.find("vertex")->count ||
      static_cast<long long>(collector.n_faces()) != header.find("face")->count)
    throw InputError(fmt::format("{}: cannot be read as PLY: {} of {} vertices and {} of {} faces found",
                                 file, collector.n_vertices(), header.find("vertex")->count,
                                 collector.n_faces(), header.find("face")->count));
  const int vertices = static_cast<int>(mesh.positions.size());
  for (int v = 0; v < vertices; ++v) {
    const Vec3& p = mesh.positions[v];
    if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
      throw InputError(fmt::format("{}: vertex {} has a coordinate that is not a finite number", file, v));
  }
  for (const auto& face : mesh.faces) {
    for (const int v : face) {
      if (v < 0 || v >= vertices)
        throw InputError(fmt::format("{}: there is no vertex {} (0 to {})", file, v, vertices - 1));
    }
  }
  return mesh;
}

}  // namespace

Mesh read_ply(const std::string& file, const std::string& contents) {
  LineReader lines(file, contents, '\0');
  const Header header = read_header(lines);
  return header.text ? read_text(lines, header) : read_binary(file, header);
}

}  // namespace isochron
