#include "core/scene/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/base/error.h"
#include "core/scene/around_edge.h"
#include "core/scene/stacked_faces.h"

namespace isochron {
namespace {

/// For each vertex the first one at the same position.
std::vector<int> first_at_position(const Mesh& mesh) {
  constexpr double kRounding = 0x1p-44;  // of the largest coordinate: what computing in double precision may leave
  double largest = 0;
  for (const auto& face : mesh.faces)
    for (const int v : face)
      for (int axis = 0; axis < 3; ++axis) largest = std::max(largest, std::abs(mesh.positions[v][axis]));
  const double cell = largest * kRounding;
  std::vector<Vec3> cells(mesh.positions);
  if (cell > 0)
    for (Vec3& p : cells) p = {std::round(p.x / cell), std::round(p.y / cell), std::round(p.z / cell)};
  std::vector<int> order(cells.size());
  std::iota(order.begin(), order.end(), 0);
  // Comparing doubles takes 0 and -0 for equal, as wanted.
  const auto key = [&](int v) { return std::tie(cells[v].x, cells[v].y, cells[v].z); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return key(a) < key(b) || (key(a) == key(b) && a < b); });
  std::vector<int> first(cells.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool repeated = i > 0 && key(order[i]) == key(order[i - 1]);
    first[order[i]] = repeated ? first[order[i - 1]] : order[i];
  }
  return first;
}

/// Marks repetitions of earlier faces.
std::vector<bool> repeated_faces(const std::vector<std::array<int, 3>>& faces) {
  struct Key {
    std::array<int, 3> corners;  // ascending
    int face;
    bool even;  // the face runs through its corners in ascending cyclic order
  };
  std::vector<Key> keys(faces.size());
  for (std::size_t f = 0; f < faces.size(); ++f) {
    std::array<int, 3> c = faces[f];
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    const bool even = c[1] < c[2];
    if (!even) std::swap(c[1], c[2]);
    keys[f] = {c, static_cast<int>(f), even};
  }
  std::sort(keys.begin(), keys.end(), [](const Key& a, const Key& b) {
    return std::tie(a.corners, a.even, a.face) < std::tie(b.corners, b.even, b.face);
  });
  std::vector<bool> repeated(faces.size(), false);
  for (std::size_t i = 1; i < keys.size(); ++i)
    repeated[keys[i].face] = keys[i].corners == keys[i - 1].corners && keys[i].even == keys[i - 1].even;
  return repeated;
}

/// Entries of an edge that more than two faces share.
void add_sectors(const Mesh& mesh, const std::array<int, 2>& vertex, const std::vector<int>& faces,
                 std::vector<Edge>& edges) {
  const Vec3 axis = normalize(mesh.positions[vertex[1]] - mesh.positions[vertex[0]]);
  std::vector<Vec3> inward;
  for (const int f : faces) {
    Vec3 d;  // to the corner off the edge
    for (const int v : mesh.faces[f])
      if (v != vertex[0] && v != vertex[1]) d = mesh.positions[v] - mesh.positions[vertex[0]];
    inward.push_back(cross(cross(axis, d), axis));
  }
  for (int i = 0; i < static_cast<int>(faces.size()); ++i)
    edges.push_back({vertex, {faces[i], faces[next_around(axis, inward, i).number]}, true});
}

}  // namespace

Mesh clean_mesh(const Mesh& mesh) {
  const std::vector<int> first = first_at_position(mesh);
  std::vector<std::array<int, 3>> faces;
  faces.reserve(mesh.faces.size());
  for (const auto& face : mesh.faces) {
    const std::array<int, 3> f{first[face[0]], first[face[1]], first[face[2]]};
    if (f[0] == f[1] || f[1] == f[2] || f[2] == f[0]) continue;
    const Vec3& a = mesh.positions[f[0]];
    if (cross(mesh.positions[f[1]] - a, mesh.positions[f[2]] - a) == Vec3{}) continue;
    faces.push_back(f);
  }
  const std::vector<bool> repeated = repeated_faces(faces);

  Mesh clean;
  std::vector<int> number(mesh.positions.size(), -1);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    if (repeated[f]) continue;
    clean.faces.push_back(faces[f]);
    for (const int v : faces[f]) number[v] = 0;
  }
  if (clean.faces.empty()) throw InputError("has no face with an area");
  FileVertices of_file;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] >= 0) {
      number[v] = static_cast<int>(clean.positions.size());
      clean.positions.push_back(mesh.positions[v] + Vec3{});  // -0 + 0 = 0
    }
    of_file.vertex.push_back(number[first[v]]);
    if (of_file.vertex.back() < 0) of_file.loose.push_back(mesh.positions[v]);
  }
  for (auto& face : clean.faces) {
    for (int& v : face) v = number[v];
  }
  if (clean.positions.size() < number.size()) clean.file_vertices = std::move(of_file);
  return clean;
}

std::vector<Edge> build_edges(const Mesh& mesh) {
  struct Side {
    std::uint64_t edge;  // smaller vertex in the upper half
    int face;
  };
  std::vector<Side> sides;
  sides.reserve(3 * mesh.faces.size());
  for (std::size_t f = 0; f < mesh.faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({mesh.faces[f][k], mesh.faces[f][(k + 1) % 3]});
      sides.push_back({static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint64_t>(high), static_cast<int>(f)});
    }
  }
  std::sort(sides.begin(), sides.end(),
            [](const Side& a, const Side& b) { return std::tie(a.edge, a.face) < std::tie(b.edge, b.face); });

  std::vector<Edge> edges;
  std::vector<int> faces;
  edges.reserve(sides.size() / 2);
  for (std::size_t i = 0, end = 0; i < sides.size(); i = end) {
    while (end < sides.size() && sides[end].edge == sides[i].edge) ++end;
    const int low = static_cast<int>(sides[i].edge >> 32), high = static_cast<int>(sides[i].edge & 0xffffffffu);
    if (end - i <= 2) {
      edges.push_back({{low, high}, {sides[i].face, end - i == 2 ? sides[i + 1].face : -1}});
      continue;
    }
    faces.clear();
    for (std::size_t k = i; k < end; ++k) faces.push_back(sides[k].face);
    add_sectors(mesh, {low, high}, faces, edges);
  }
  return edges;
}

int add_shape(Scene& scene, Shape shape, const Mesh& mesh, const std::vector<Edge>& edges) {
  const int index = static_cast<int>(scene.shapes.size());
  const int v = shape.first_vertex = static_cast<int>(scene.positions.size());
  const int t = shape.first_triangle = static_cast<int>(scene.triangles.size());
  shape.first_edge = static_cast<int>(scene.edges.size());
  shape.vertex_count = static_cast<int>(mesh.positions.size());
  shape.triangle_count = static_cast<int>(mesh.faces.size());
  shape.edge_count = static_cast<int>(edges.size());
  scene.positions.insert(scene.positions.end(), mesh.positions.begin(), mesh.positions.end());
  for (const auto& f : mesh.faces) scene.triangles.push_back({{f[0] + v, f[1] + v, f[2] + v}, index});
  for (const Edge& e : edges) {
    const int other = e.face[1] < 0 ? -1 : e.face[1] + t;
    scene.edges.push_back({{e.vertex[0] + v, e.vertex[1] + v}, {e.face[0] + t, other}, e.sector});
  }
  if (mesh.file_vertices) shape.file_vertices = std::make_shared<const FileVertices>(*mesh.file_vertices);
  for (const auto& pair : stacked_faces(mesh.positions, mesh.faces))
    scene.stacked.push_back({pair[0] + t, pair[1] + t});
  scene.shapes.push_back(std::move(shape));
  return index;
}

}  // namespace isochron
