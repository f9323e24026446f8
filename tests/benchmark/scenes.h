// What the benchmarks run on: a small and a large scene, their gates, and what moves in them.
#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "core/base/constants.h"
#include "core/gates/gate.h"
#include "core/scene/mesh.h"
#include "core/scene/scene.h"
#include "core/scene/scene_loader.h"
#include "tests/render/subdivision.h"

namespace isochron::benchmarks {

using testing::subdivided;

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
  const Shape block = scene.shapes.back();
  scene.shapes.pop_back();
  scene.positions.resize(block.first_vertex);
  scene.triangles.resize(block.first_triangle);
  scene.edges.resize(block.first_edge);
  const Mesh ball = clean_mesh(bumpy_ball({-0.2, -0.4, 0.15}, 0.45));
  add_shape(scene, block, ball, build_edges(ball));
  return scene;
}

/// Ten gates that reach most paths through the box.
inline GateSet wide_gates() {
  return {GateShape::gaussian(0.25), {5, 5.5, 6, 6.5, 7, 7.5, 8, 8.5, 9, 9.5}};
}
/// A gate of 0.5 % of the path length: ellipsoidal sampling's case.
inline GateSet narrow_gates() {
  return {GateShape::gaussian(0.03), {6}};
}

/// A shape's translation along x: one column.
inline TangentBasis translation(const Scene& scene, const Shape& block) {
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
/// That of the block (or ball).
inline TangentBasis translation(const Scene& scene) {
  return translation(scene, scene.shapes.back());
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
