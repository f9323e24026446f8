// The unit cube, and whether a mesh is it.
#pragma once
#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "core/scene/mesh.h"

namespace isochron {

using Face = std::array<int, 3>;

/// Corners of the unit cube's six faces, seen from outside counter-clockwise; corner i is (i & 1, i / 2 & 1,
/// i / 4).
inline constexpr int kCube[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};

inline Vec3 cube_corner(int i) {
  return {double(i & 1), double(i >> 1 & 1), double(i >> 2)};
}

inline double volume(const Mesh& mesh) {
  double sum = 0;
  for (const Face& f : mesh.faces)
    sum += dot(mesh.positions[f[0]], cross(mesh.positions[f[1]], mesh.positions[f[2]])) / 6;
  return sum;
}

/// A closed cube of volume one with 8 vertices, 12 faces and 18 edges, whatever its file.
inline void expect_cube(const Mesh& raw) {
  const Mesh mesh = clean_mesh(raw);
  EXPECT_EQ(mesh.positions.size(), 8u);
  EXPECT_EQ(mesh.faces.size(), 12u);
  EXPECT_NEAR(volume(mesh), 1, 1e-15);  // also tells the orientation
  const std::vector<Edge> edges = build_edges(mesh);
  EXPECT_EQ(edges.size(), 18u);
  for (const Edge& edge : edges) {
    EXPECT_GE(edge.face[0], 0);
    EXPECT_GT(edge.face[1], edge.face[0]);
  }
}

}  // namespace isochron
