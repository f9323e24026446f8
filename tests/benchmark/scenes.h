// What the benchmarks run on: a small and a large scene, their gates, and what moves in them.
#pragma once
#include <array>
#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/gates/gate.h"
#include "core/math/constants.h"
#include "core/scene/mesh.h"
#include "core/scene/scene.h"
#include "core/scene/scene_loader.h"

namespace isochron::benchmarks {

/// The reference box: two dozen triangles.
inline Scene small_scene() {
  return load_scene(PROJECT_ROOT "/tests/data/reference/scene.yaml");
}

/// A bumpy ball of 70 000 triangles: rings of latitude between two poles.
inline Mesh bumpy_ball(const Vec3& center, double radius) {
  constexpr int kRings = 140, kColumns = 250;
  Mesh mesh;
  const auto add = [&](double theta, double phi) {
    const double ripple = std::sin(11 * phi) * std::sin(9 * theta) * std::sin(theta);
    const double r = radius * (1 + 0.08 * ripple);
    mesh.positions.push_back(
        center + r * Vec3{std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi)});
  };
  for (int ring = 0; ring < kRings; ++ring)
    for (int column = 0; column < kColumns; ++column) add(kPi * (ring + 1) / (kRings + 1), kTwoPi * column / kColumns);
  const int north = kRings * kColumns, south = north + 1;
  add(0, 0);
  add(kPi, 0);
  const auto at = [&](int ring, int column) { return ring * kColumns + column % kColumns; };
  for (int column = 0; column < kColumns; ++column) {
    mesh.faces.push_back({north, at(0, column + 1), at(0, column)});
    for (int ring = 0; ring + 1 < kRings; ++ring) {
      mesh.faces.push_back({at(ring, column), at(ring, column + 1), at(ring + 1, column)});
      mesh.faces.push_back({at(ring, column + 1), at(ring + 1, column + 1), at(ring + 1, column)});
    }
    mesh.faces.push_back({south, at(kRings - 1, column), at(kRings - 1, column + 1)});
  }
  return mesh;
}

/// The reference box with its block, the last shape, replaced by the bumpy ball.
inline Scene large_scene() {
  Scene scene = small_scene();
  Shape& block = scene.shapes.back();
  scene.positions.resize(block.first_vertex);
  scene.triangles.resize(block.first_triangle);
  std::erase_if(scene.edges, [&](const Edge& e) { return e.vertex[1] >= block.first_vertex; });

  const Mesh ball = clean_mesh(bumpy_ball({-0.2, -0.4, 0.15}, 0.45));
  const int shape = static_cast<int>(scene.shapes.size()) - 1;
  block.vertex_count = static_cast<int>(ball.positions.size());
  block.triangle_count = static_cast<int>(ball.faces.size());
  scene.positions.insert(scene.positions.end(), ball.positions.begin(), ball.positions.end());
  for (const auto& face : ball.faces) {
    Triangle t{face, shape};
    for (int& v : t.vertex) v += block.first_vertex;
    scene.triangles.push_back(t);
  }
  for (Edge e : build_edges(ball)) {
    for (int& v : e.vertex) v += block.first_vertex;
    for (int& f : e.face)
      if (f >= 0) f += block.first_triangle;
    scene.edges.push_back(e);
  }
  return scene;
}

/// The same surfaces with every triangle cut in four, `levels` times.
inline Scene subdivided(const Scene& scene, int levels) {
  Scene fine = scene;
  fine.positions.clear();
  fine.triangles.clear();
  fine.edges.clear();
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    const Shape& shape = scene.shapes[s];
    Mesh mesh;
    mesh.positions.assign(scene.positions.begin() + shape.first_vertex,
                          scene.positions.begin() + shape.first_vertex + shape.vertex_count);
    for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
      auto face = scene.triangles[t].vertex;
      for (int& v : face) v -= shape.first_vertex;
      mesh.faces.push_back(face);
    }
    for (int level = 0; level < levels; ++level) {
      std::map<std::pair<int, int>, int> middles;
      const auto middle = [&](int a, int b) {
        const auto [place, fresh] = middles.try_emplace(std::minmax(a, b), static_cast<int>(mesh.positions.size()));
        if (fresh) mesh.positions.push_back((mesh.positions[a] + mesh.positions[b]) * 0.5);
        return place->second;
      };
      std::vector<std::array<int, 3>> faces;
      for (const auto& f : mesh.faces) {
        const int m[3] = {middle(f[0], f[1]), middle(f[1], f[2]), middle(f[2], f[0])};
        faces.insert(faces.end(), {{f[0], m[0], m[2]}, {m[0], f[1], m[1]}, {m[2], m[1], f[2]}, {m[0], m[1], m[2]}});
      }
      mesh.faces = std::move(faces);
    }
    Shape& out = fine.shapes[s];
    out.first_vertex = static_cast<int>(fine.positions.size());
    out.vertex_count = static_cast<int>(mesh.positions.size());
    out.first_triangle = static_cast<int>(fine.triangles.size());
    out.triangle_count = static_cast<int>(mesh.faces.size());
    for (Edge e : build_edges(mesh)) {
      for (int& v : e.vertex) v += out.first_vertex;
      for (int& f : e.face)
        if (f >= 0) f += out.first_triangle;
      fine.edges.push_back(e);
    }
    for (auto f : mesh.faces) {
      for (int& v : f) v += out.first_vertex;
      fine.triangles.push_back({f, static_cast<int>(s)});
    }
    fine.positions.insert(fine.positions.end(), mesh.positions.begin(), mesh.positions.end());
  }
  return fine;
}

/// Ten gates that reach most paths through the box.
inline GateSet wide_gates() {
  return {GateShape::gaussian(0.25), {5, 5.5, 6, 6.5, 7, 7.5, 8, 8.5, 9, 9.5}};
}
/// A gate of 0.5 % of the path length: ellipsoidal sampling's case.
inline GateSet narrow_gates() {
  return {GateShape::gaussian(0.03), {6}};
}

/// The block's (or ball's) translation along x: one column.
inline TangentBasis translation(const Scene& scene) {
  const Shape& block = scene.shapes.back();
  TangentBasis basis;
  basis.columns = 1;
  basis.row_begin.push_back(0);
  for (int dof = 0; dof < DofLayout(scene).size(); ++dof) {
    const int v = dof / 3;
    if (dof % 3 == 0 && v >= block.first_vertex && v < block.first_vertex + block.vertex_count)
      basis.entries.push_back({0, 1.0});
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  return basis;
}

/// Every coordinate of every vertex of the block (or ball): a column each.
inline TangentBasis all_vertices(const Scene& scene) {
  const Shape& block = scene.shapes.back();
  TangentBasis basis;
  basis.row_begin.push_back(0);
  for (int dof = 0; dof < DofLayout(scene).size(); ++dof) {
    const int v = dof / 3;
    if (v >= block.first_vertex && v < block.first_vertex + block.vertex_count)
      basis.entries.push_back({basis.columns++, 1.0});
    basis.row_begin.push_back(static_cast<int>(basis.entries.size()));
  }
  return basis;
}

}  // namespace isochron::benchmarks
