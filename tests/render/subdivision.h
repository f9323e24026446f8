// The same surfaces in more triangles.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/scene/mesh.h"
#include "core/scene/scene.h"

namespace isochron::testing {

/// The same surface with every triangle cut into n x n.
inline Mesh subdivided(const Mesh& mesh, int n) {
  Mesh fine;
  fine.positions = mesh.positions;
  std::map<std::pair<int, int>, int> edges;  // to the first of the n - 1 vertices that cut one
  const auto fresh = [&](const Vec3& p) {
    fine.positions.push_back(p);
    return static_cast<int>(fine.positions.size()) - 1;
  };
  const auto lerp = [](const Vec3& a, const Vec3& b, double share) { return a * (1 - share) + b * share; };
  const auto between = [&](int a, int b, double share) { return lerp(mesh.positions[a], mesh.positions[b], share); };
  // Vertex number i of n on the way from a to b.
  const auto on_edge = [&](int a, int b, int i) {
    if (i == 0 || i == n) return i == 0 ? a : b;
    const auto [place, is_new] = edges.try_emplace(std::minmax(a, b), static_cast<int>(fine.positions.size()));
    const auto [first, last] = place->first;
    for (int k = 1; is_new && k < n; ++k) fresh(between(first, last, static_cast<double>(k) / n));
    return place->second + (a == first ? i : n - i) - 1;
  };
  for (const auto& face : mesh.faces) {
    std::vector<std::vector<int>> row(n + 1);  // row i: i steps from corner 0, i + 1 vertices
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= i; ++j) {
        int v;
        if (i == n)
          v = on_edge(face[1], face[2], j);
        else if (j == 0)
          v = on_edge(face[0], face[1], i);
        else if (j == i)
          v = on_edge(face[0], face[2], i);
        else {
          const double share = static_cast<double>(i) / n;
          v = fresh(
              lerp(between(face[0], face[1], share), between(face[0], face[2], share), static_cast<double>(j) / i));
        }
        row[i].push_back(v);
      }
    for (int i = 0; i < n; ++i)
      for (int j = 0; j <= i; ++j) {
        fine.faces.push_back({row[i][j], row[i + 1][j], row[i + 1][j + 1]});
        if (j < i) fine.faces.push_back({row[i][j], row[i + 1][j + 1], row[i][j + 1]});
      }
  }
  return fine;
}

/// The same picture with every triangle of all but the shape `whole` cut into n x n.
inline Scene subdivided(const Scene& scene, int n, const std::string& whole = {}) {
  Scene fine = scene;
  fine.positions.clear();
  fine.triangles.clear();
  fine.edges.clear();
  fine.shapes.clear();
  for (const Shape& shape : scene.shapes) {
    Mesh coarse;
    coarse.positions.assign(scene.positions.begin() + shape.first_vertex,
                            scene.positions.begin() + shape.first_vertex + shape.vertex_count);
    for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
      auto face = scene.triangles[t].vertex;
      for (int& v : face) v -= shape.first_vertex;
      coarse.faces.push_back(face);
    }
    const Mesh mesh = shape.name == whole ? coarse : subdivided(coarse, n);
    add_shape(fine, shape, mesh, build_edges(mesh));
  }
  return fine;
}

}  // namespace isochron::testing
