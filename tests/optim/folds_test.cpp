#include "optim/remesh/folds.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/base/constants.h"

namespace isochron {
namespace {

constexpr int kFoldedSide = 12;

int corner(int x, int y) {
  return y * (kFoldedSide + 1) + x;
}

/// A wave over the unit square.
Mesh wavy_sheet() {
  Mesh mesh;
  for (int y = 0; y <= kFoldedSide; ++y)
    for (int x = 0; x <= kFoldedSide; ++x)
      mesh.positions.push_back({1.0 * x / kFoldedSide, 1.0 * y / kFoldedSide,
                                0.1 * std::sin(2 * kPi * x / kFoldedSide) * std::sin(2 * kPi * y / kFoldedSide)});
  for (int y = 0; y < kFoldedSide; ++y)
    for (int x = 0; x < kFoldedSide; ++x) {
      mesh.faces.push_back({corner(x, y), corner(x + 1, y), corner(x + 1, y + 1)});
      mesh.faces.push_back({corner(x, y), corner(x + 1, y + 1), corner(x, y + 1)});
    }
  return mesh;
}

/// Edges whose triangles turn by more than that.
int folds_of(const Mesh& mesh, double cosine) {
  int count = 0;
  const auto normal = [&](int face) {
    const auto& [a, b, c] = mesh.faces[face];
    const std::vector<Vec3>& p = mesh.positions;
    return normalize(cross(p[b] - p[a], p[c] - p[a]));
  };
  for (const Edge& edge : build_edges(mesh))
    count += edge.face[1] >= 0 && dot(normal(edge.face[0]), normal(edge.face[1])) < cosine;
  return count;
}

TEST(Unfolded, HasNoFoldsInside) {
  Mesh mesh = wavy_sheet();
  for (int up : {0, 1})  // beyond their neighbours, and a little above
    mesh.positions[corner(6, 6 + up)] += Vec3{1.7 / kFoldedSide, 0, 0.2 / kFoldedSide};
  ASSERT_GT(folds_of(mesh, -0.5), 0);
  const Mesh found = unfolded(mesh);
  EXPECT_EQ(folds_of(found, -0.5), 0);
  int moved = 0;
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) moved += length(found.positions[v] - mesh.positions[v]) > 0;
  EXPECT_GT(moved, 0);
  EXPECT_LT(moved, 16);
}

TEST(Unfolded, LeavesBordersAsTheyAre) {
  Mesh mesh = wavy_sheet();
  mesh.positions[corner(0, 5)] += Vec3{1.7 / kFoldedSide, 0, 0.2 / kFoldedSide};
  ASSERT_GT(folds_of(mesh, -0.5), 0);
  const Mesh found = unfolded(mesh);
  for (int y = 0; y <= kFoldedSide; ++y)
    for (const int v : {corner(0, y), corner(kFoldedSide, y), corner(y, 0), corner(y, kFoldedSide)})
      EXPECT_EQ(length(found.positions[v] - mesh.positions[v]), 0);
}

/// A tetrahedron's faces turn by 109 degrees.
TEST(Unfolded, LeavesCreasesAsTheyAre) {
  const Mesh tetrahedron{{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}},
                         {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
  EXPECT_EQ(folds_of(tetrahedron, 0), 6);
  const Mesh found = unfolded(tetrahedron);
  for (int v = 0; v < 4; ++v) EXPECT_EQ(length(found.positions[v] - tetrahedron.positions[v]), 0);
}

}  // namespace
}  // namespace isochron
