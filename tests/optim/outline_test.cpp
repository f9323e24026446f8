// Where surfaces end by the albedos on them. Closed forms, no random numbers.
#include "optim/remesh/outline.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

namespace isochron {
namespace {

/// The square from `corner` to `corner` + 1 of so many cells each way, in `mesh`.
void add_square(Mesh& mesh, const Vec3& corner, int cells) {
  const int before = static_cast<int>(mesh.positions.size());
  for (int y = 0; y <= cells; ++y)
    for (int x = 0; x <= cells; ++x)
      mesh.positions.push_back(corner + Vec3{double{1} * x / cells, double{1} * y / cells, 0});
  const auto at = [&](int x, int y) { return before + y * (cells + 1) + x; };
  for (int y = 0; y < cells; ++y)
    for (int x = 0; x < cells; ++x) {
      mesh.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
}

std::vector<double> painted(const Mesh& mesh, const std::function<double(const Vec3&)>& albedo) {
  std::vector<double> values;
  for (const Vec3& p : mesh.positions) values.push_back(albedo(p));
  return values;
}

/// Area of what is left; its triangles are manifold, and face as those of the mesh did.
double area_left(const Remeshed& left) {
  double area = 0;
  for (const auto& [a, b, c] : left.mesh.faces) {
    const std::vector<Vec3>& p = left.mesh.positions;
    const Vec3 twice = cross(p[b] - p[a], p[c] - p[a]);
    EXPECT_GT(twice.z, 0);
    area += twice.z / 2;
  }
  if (!left.mesh.faces.empty()) {
    EXPECT_NO_THROW(require_remeshable(left.mesh, 0.1));
  }
  return area;
}

/// Light of albedos x comes from one of 2/3 on average; 0.6 of that is at x = 0.4, between two vertices.
TEST(Outline, EndsWhereTheAlbedoIsThatShareOfTheTypicalOne) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 31);
  const std::vector<double> albedo = painted(mesh, [](const Vec3& p) { return p.x; });
  for (const double typical : typical_albedos(mesh, albedo)) EXPECT_NEAR(typical, 2.0 / 3, 0.001);
  const Remeshed left = within_outline(mesh, albedo, 0.6, 0);
  EXPECT_NEAR(area_left(left), 0.6, 0.001);
  const std::vector<double> values = carry_over(left, mesh, albedo);
  ASSERT_EQ(values.size(), left.mesh.positions.size());
  for (std::size_t v = 0; v < values.size(); ++v) {
    EXPECT_NEAR(values[v], left.mesh.positions[v].x, 1e-12);
    EXPECT_GT(values[v], 0.398);
  }
}

TEST(Outline, PartsHaveTypicalAlbedosOfTheirOwn) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 8);
  add_square(mesh, {3, 0, 0}, 8);
  const Remeshed left = within_outline(mesh, painted(mesh, [](const Vec3& p) { return p.x < 2 ? 0.9 : 0.1; }), 0.5, 0);
  EXPECT_NEAR(area_left(left), 2, 1e-9);
}

TEST(Outline, DarkPartsGoUnlessAllAre) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 8);
  add_square(mesh, {3, 0, 0}, 8);
  EXPECT_NEAR(area_left(within_outline(mesh, painted(mesh, [](const Vec3& p) { return p.x < 2 ? 0.9 : 0; }), 0.5, 0)),
              1, 1e-9);
  EXPECT_NEAR(area_left(within_outline(mesh, painted(mesh, [](const Vec3&) { return 0; }), 0.5, 0)), 2, 1e-9);
}

/// A dark web, three vertices wide, tears halfway to the bright ones beside it. A dark spot and a bright one beyond, each as
/// large as a cell, stay and go.
TEST(Outline, WebsTearButSpecksDoNot) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 40);
  const auto web = [](const Vec3& p) { return std::abs(p.x - 0.5) < 0.04 ? 0.0 : 0.5; };
  const auto specked = [&](const Vec3& p) {
    if (length(p - Vec3{0.25, 0.5, 0}) < 0.01) return 0.0;
    return length(p - Vec3{0.5, 0.5, 0}) < 0.01 ? 0.5 : web(p);
  };
  const double cell = 1.0 / 1600;
  const Remeshed torn = within_outline(mesh, painted(mesh, web), 0.5, 2 * cell),
                 same = within_outline(mesh, painted(mesh, specked), 0.5, 2 * cell),
                 pierced = within_outline(mesh, painted(mesh, specked), 0.5, 0);
  EXPECT_NEAR(area_left(torn), 0.925, 1e-9);
  EXPECT_EQ(same.mesh.faces, torn.mesh.faces);
  EXPECT_NE(pierced.mesh.faces.size(), torn.mesh.faces.size());
  area_left(pierced);
}

TEST(Outline, NothingIsLeftOfSpecksAlone) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 4);
  const std::vector<double> even(mesh.positions.size(), 0.3);
  EXPECT_NEAR(area_left(within_outline(mesh, even, 0.5, 0.5)), 1, 1e-12);
  EXPECT_TRUE(within_outline(mesh, even, 0.5, 2).mesh.faces.empty());
}

TEST(Outline, SmallPartsGo) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 4);
  add_square(mesh, {5, 0, 0}, 2);
  for (int v = 25; v < std::ssize(mesh.positions); ++v) mesh.positions[v] = mesh.positions[v] * 0.1;
  EXPECT_NEAR(area_left(without_small_parts(mesh, 0.0099)), 1.01, 1e-12);
  const Remeshed left = without_small_parts(mesh, 0.0101);
  EXPECT_NEAR(area_left(left), 1, 1e-12);
  EXPECT_EQ(left.mesh.positions.size(), 25u);
  EXPECT_TRUE(without_small_parts(mesh, 1.01).mesh.faces.empty());
}

/// A square of 5 x 5 cells without one triangle, or without one cell: holes are closed below the border of a triangle with that area.
TEST(Outline, SmallHolesAreClosed) {
  for (const std::size_t missing : {1, 2}) {
    Mesh mesh;
    add_square(mesh, {0, 0, 0}, 5);
    mesh.faces.erase(mesh.faces.begin() + 24, mesh.faces.begin() + 24 + static_cast<std::ptrdiff_t>(missing));
    const double border = missing == 1 ? (2 + std::sqrt(2.0)) / 5 : 4.0 / 5,
                 area = border * border * std::sqrt(3.0) / 36;
    EXPECT_NEAR(area_left(without_small_holes(mesh, 0.999 * area)), 1 - 0.02 * static_cast<double>(missing), 1e-12);
    EXPECT_NEAR(area_left(without_small_holes(mesh, 1.001 * area)), 1, 1e-12);
  }
}

/// Borders of a part by itself are no holes, however short they are.
TEST(Outline, SmallPartsAreNotClosed) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 1);
  for (const double least : {0.7, 0.9, 2.0}) EXPECT_EQ(without_small_holes(mesh, least).mesh.faces.size(), 2u) << least;
}

/// A square of 8 x 8 cells without 2 x 5 of them: one cell is left beyond this hole at one end, two at the other. The strip of one cell is cut
/// where its edges are short enough. The other one, with inner vertices, and both sides of the hole stay.
TEST(Outline, NarrowStripsAreCut) {
  Mesh whole;
  add_square(whole, {0, 0, 0}, 8);
  Mesh mesh{whole.positions, {}};
  for (std::size_t f = 0; f < whole.faces.size(); ++f) {
    const std::size_t x = f / 2 % 8, y = f / 16;
    if (!((x == 3 || x == 4) && y >= 1 && y < 6)) mesh.faces.push_back(whole.faces[f]);
  }
  const double area = 1 - 10.0 / 64;
  EXPECT_NEAR(area_left(without_narrow_strips(mesh, 0.999 / 8)), area, 1e-12);
  const Remeshed cut = without_narrow_strips(mesh, 1.001 / 8);
  EXPECT_NEAR(area_left(cut), area - 0.055, 0.01);
  double lowest = 1;  // of the strip
  for (const Vec3& p : cut.mesh.positions)
    if (std::abs(p.x - 0.5) < 1e-12) lowest = std::min(lowest, p.y);
  EXPECT_NEAR(lowest, 0.75, 1e-12);
}

/// Of two squares that one cell joins, whose sides are one border.
TEST(Outline, NecksStay) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 4);
  add_square(mesh, {1.25, 0, 0}, 4);
  const int right = 25;
  mesh.faces.push_back({4, right, right + 5});
  mesh.faces.push_back({4, right + 5, 9});
  EXPECT_NEAR(area_left(without_narrow_strips(mesh, 1)), 2 + 1.0 / 16, 1e-12);
}

/// A square whose middle cell is missing, beside a whole one: all of its vertices lie on its two borders.
TEST(Outline, ThinRingsStay) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 3);
  mesh.faces.erase(mesh.faces.begin() + 8, mesh.faces.begin() + 10);
  add_square(mesh, {2, 0, 0}, 4);
  EXPECT_NEAR(area_left(without_narrow_strips(mesh, 0.5)), 2 - 1.0 / 9, 1e-12);
}

/// A fit that pulls a hole together to a point leaves edges of no length, which remeshing takes away once it is closed.
TEST(Outline, RemeshingMendsAClosedHole) {
  Mesh mesh;
  add_square(mesh, {0, 0, 0}, 5);
  const std::array<int, 3> hole = mesh.faces[24];
  mesh.faces.erase(mesh.faces.begin() + 24);
  const Vec3 middle = (mesh.positions[hole[0]] + mesh.positions[hole[1]] + mesh.positions[hole[2]]) / 3.0;
  for (const int v : hole) mesh.positions[v] = middle + 1e-10 * (mesh.positions[v] - middle);
  const auto shortest = [](const Mesh& found) {
    double least = 1;
    for (const Edge& edge : build_edges(found))
      least = std::min(least, length(found.positions[edge.vertex[1]] - found.positions[edge.vertex[0]]));
    return least;
  };
  EXPECT_LT(shortest(remesh(mesh, 0.2).mesh), 1e-6) << "as it is";
  const Remeshed closed = without_small_holes(mesh, 0.01);
  EXPECT_GT(shortest(remesh(closed.mesh, 0.2).mesh), 0.05);
}

}  // namespace
}  // namespace isochron
