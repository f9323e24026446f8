#include "optim/remesh/remesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>
#include <set>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "core/geometry/mesh_intersections.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// A grid over [0, 1]^2 with so many cells along its sides, whose two ends are one where the surface closes.
Mesh grid(int columns, int rows, bool closed, const std::function<Vec3(double, double)>& point) {
  Mesh mesh;
  const int across = closed ? columns : columns + 1, down = closed ? rows : rows + 1;
  for (int y = 0; y < down; ++y)
    for (int x = 0; x < across; ++x) mesh.positions.push_back(point(double{1} * x / columns, double{1} * y / rows));
  const auto at = [&](int x, int y) { return y % down * across + x % across; };
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      mesh.faces.push_back({at(x, y), at(x + 1, y), at(x + 1, y + 1)});
      mesh.faces.push_back({at(x, y), at(x + 1, y + 1), at(x, y + 1)});
    }
  return mesh;
}

Mesh torus(int around, int across) {
  return grid(around, across, true, [](double u, double v) {
    const double radius = 1 + 0.4 * std::cos(2 * kPi * v);
    return Vec3{radius * std::cos(2 * kPi * u), radius * std::sin(2 * kPi * u), 0.4 * std::sin(2 * kPi * v)};
  });
}

/// A ball of so many divisions of an octahedron, whose triangles differ in size.
Mesh ball(int divisions, double radius) {
  Mesh mesh{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}},
            {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}}};
  for (int i = 0; i < divisions; ++i) {
    std::map<std::set<int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, is_new] = middles.try_emplace({a, b}, static_cast<int>(mesh.positions.size()));
      if (is_new) mesh.positions.push_back(normalize(mesh.positions[a] + mesh.positions[b]));
      return found->second;
    };
    std::vector<std::array<int, 3>> faces;
    for (const auto& [a, b, c] : mesh.faces) {
      const int ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
      faces.insert(faces.end(), {{a, ab, ca}, {b, bc, ab}, {c, ca, bc}, {ab, bc, ca}});
    }
    mesh.faces = faces;
  }
  for (Vec3& p : mesh.positions) p *= radius;
  return mesh;
}

/// Puts another mesh beside it.
void add(Mesh& mesh, const Mesh& other, const Vec3& at) {
  const int first = static_cast<int>(mesh.positions.size());
  for (const Vec3& p : other.positions) mesh.positions.push_back(p + at);
  for (const auto& f : other.faces) mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
}

/// A sheet of 1 x 0.6 with corners, whose inner vertices lie irregularly.
Mesh sheet() {
  std::mt19937 random(test_seed(5));
  std::uniform_real_distribution<double> shift(-0.3, 0.3);
  Mesh mesh = grid(12, 7, false, [&](double u, double v) {
    const bool inside = u > 0.01 && u < 0.99 && v > 0.01 && v < 0.99;
    return Vec3{u + (inside ? shift(random) / 12 : 0), 0.6 * (v + (inside ? shift(random) / 7 : 0)), 0};
  });
  return mesh;
}

Vec3 double_area(const Mesh& mesh, const std::array<int, 3>& f) {
  return cross(mesh.positions[f[1]] - mesh.positions[f[0]], mesh.positions[f[2]] - mesh.positions[f[0]]);
}

double area(const Mesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.faces) sum += length(double_area(mesh, f)) / 2;
  return sum;
}

double volume(const Mesh& mesh) {
  double sum = 0;
  for (const auto& f : mesh.faces) sum += dot(mesh.positions[f[0]], double_area(mesh, f)) / 6;
  return sum;
}

int euler_characteristic(const Mesh& mesh) {
  return static_cast<int>(mesh.positions.size()) - static_cast<int>(build_edges(mesh).size()) +
         static_cast<int>(mesh.faces.size());
}

std::vector<double> edge_lengths(const Mesh& mesh) {
  std::vector<double> lengths;
  for (const Edge& e : build_edges(mesh))
    lengths.push_back(length(mesh.positions[e.vertex[1]] - mesh.positions[e.vertex[0]]));
  return lengths;
}

double share_within(const std::vector<double>& values, double low, double high) {
  const auto count = std::count_if(values.begin(), values.end(), [&](double v) { return v >= low && v <= high; });
  return double{1} * static_cast<double>(count) / static_cast<double>(values.size());
}

/// Ratio of twice the area to the square of the longest edge.
double thinnest(const Mesh& mesh) {
  double least = 1;
  for (const auto& f : mesh.faces) {
    double longest = 0;
    for (int k = 0; k < 3; ++k)
      longest = std::max(longest, length_squared(mesh.positions[f[(k + 1) % 3]] - mesh.positions[f[k]]));
    least = std::min(least, length(double_area(mesh, f)) / longest);
  }
  return least;
}

std::size_t crossings(const Mesh& mesh) {
  const Scene scene = scene_of(mesh);
  const MeshIntersections intersections(scene, ray_offset(scene));
  return intersections.segments().size();
}

/// What holds of every result.
void expect_regular(const Mesh& old, const Remeshed& result, double edge_length) {
  const Mesh& mesh = result.mesh;
  EXPECT_GE(share_within(edge_lengths(mesh), 0.6 * edge_length, 1.5 * edge_length), 0.95);
  EXPECT_EQ(euler_characteristic(mesh), euler_characteristic(old));
  EXPECT_GT(thinnest(mesh), 0.15);
  EXPECT_EQ(crossings(mesh), 0u);
  // Vertices lie on the old surface, so that a linear field is carried over as it is.
  const auto field = [](const Vec3& p) { return 0.3 + 2 * p.x - 0.7 * p.y + 1.1 * p.z; };
  std::vector<double> values;
  for (const Vec3& p : old.positions) values.insert(values.end(), {field(p), -p.x});
  const std::vector<double> carried = carry_over(result, old, values, 2);
  ASSERT_EQ(carried.size(), 2 * mesh.positions.size());
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) {
    EXPECT_NEAR(carried[2 * v], field(mesh.positions[v]), 1e-12);
    EXPECT_NEAR(carried[2 * v + 1], -mesh.positions[v].x, 1e-12);
  }
}

TEST(Remesh, SheetKeepsAreaBorderAndCorners) {
  const Mesh old = sheet();
  for (const double length_wanted : {0.03, 0.05, 0.15}) {
    SCOPED_TRACE(length_wanted);
    const Remeshed result = remesh(old, length_wanted);
    expect_regular(old, result, length_wanted);
    EXPECT_NEAR(area(result.mesh), 0.6, 1e-12);
    double border = 0;
    for (const Edge& e : build_edges(result.mesh))
      if (e.face[1] < 0) border += length(result.mesh.positions[e.vertex[1]] - result.mesh.positions[e.vertex[0]]);
    EXPECT_NEAR(border, 3.2, 1e-12);
    for (const auto& f : result.mesh.faces) EXPECT_GT(double_area(result.mesh, f).z, 0);
    for (const Vec3& corner : {Vec3{0, 0, 0}, Vec3{1, 0, 0}, Vec3{0, 0.6, 0}, Vec3{1, 0.6, 0}})
      EXPECT_TRUE(std::any_of(result.mesh.positions.begin(), result.mesh.positions.end(),
                              [&](const Vec3& p) { return length(p - corner) < 1e-12; }));
  }
}

TEST(Remesh, BallStaysOne) {
  const Mesh old = ball(4, 2);
  for (const double length_wanted : {0.15, 0.3}) {
    SCOPED_TRACE(length_wanted);
    const Remeshed result = remesh(old, length_wanted);
    expect_regular(old, result, length_wanted);
    for (const auto& f : result.mesh.faces)
      EXPECT_GT(dot(double_area(result.mesh, f), result.mesh.positions[f[0]]), 0) << "folded";
  }
}

/// A few large triangles, with creases, become many small ones, and a ball of less than an edge a few large ones.
TEST(Remesh, FarFromTheWantedLength) {
  const Mesh tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};
  const Remeshed fine = remesh(tetrahedron, 0.05);
  expect_regular(tetrahedron, fine, 0.05);
  // Each of the six creases, 7.2 long together, loses a strip on either side that is about as wide as an edge is long.
  EXPECT_LT(area(tetrahedron) - area(fine.mesh), 2 * 7.2 * 0.05);
  const Remeshed coarse = remesh(ball(3, 1), 100);
  EXPECT_EQ(coarse.mesh.faces.size(), 4u);
  EXPECT_GT(volume(coarse.mesh), 0);
}

/// Chords of length h lie h^2 / 8r inside of a circle of radius r: area, volume and distance change by the square of h.
TEST(Remesh, ErrorsAreOfSecondOrder) {
  const Mesh old = torus(240, 100);
  std::vector<std::array<double, 3>> errors;
  for (const double length_wanted : {0.2, 0.1}) {
    SCOPED_TRACE(length_wanted);
    const Remeshed result = remesh(old, length_wanted);
    expect_regular(old, result, length_wanted);
    double farthest = 0;
    for (const auto& f : result.mesh.faces) {
      const Vec3 p = (result.mesh.positions[f[0]] + result.mesh.positions[f[1]] + result.mesh.positions[f[2]]) / 3.0;
      farthest = std::max(farthest, std::abs(std::hypot(std::hypot(p.x, p.y) - 1, p.z) - 0.4));
    }
    errors.push_back({1 - area(result.mesh) / area(old), 1 - volume(result.mesh) / volume(old), farthest});
  }
  for (int k = 0; k < 3; ++k) {
    EXPECT_GT(errors[0][k], 0);
    EXPECT_NEAR(errors[0][k] / errors[1][k], 4, 1.2) << k;
  }
  EXPECT_LT(errors[1][2], 0.1 * 0.1 / 0.4 / 4);
}

/// Two bent sheets, at one end nearer to each other than what chords of the wanted length lie inside.
TEST(Remesh, NothingPassesThroughAnything) {
  Mesh old;
  for (const double slope : {0.0, 0.6}) {
    const Mesh sheet = grid(60, 40, false, [&](double u, double v) {
      const double radius = slope == 0 ? 1 : 0.99 - slope * u;
      return Vec3{radius * std::cos(kPi * u), radius * std::sin(kPi * u), 2 * v};
    });
    add(old, sheet, {});
  }
  const Remeshed result = remesh(old, 0.4);
  EXPECT_EQ(crossings(result.mesh), 0u);
  EXPECT_EQ(euler_characteristic(result.mesh), 2);
  EXPECT_LT(result.mesh.faces.size(), old.faces.size() / 2);
}

TEST(Remesh, WhatPassesThroughItselfStaysThere) {
  Mesh old = ball(3, 1);
  add(old, ball(3, 1), {1.2, 0.1, 0.05});
  const Remeshed result = remesh(old, 0.1);
  EXPECT_EQ(euler_characteristic(result.mesh), 4);
  EXPECT_GT(crossings(result.mesh), 0u);
  EXPECT_GT(share_within(edge_lengths(result.mesh), 0.06, 0.15), 0.8);
}

/// Borders that cross, some of whose vertices are closest to corners of the other one's: readers would take two there for one.
TEST(Remesh, NoTwoVerticesComeToOnePlace) {
  const auto sheet = [](double u, double v) {
    const double x = 2 * u - 1, y = 2 * v - 1;
    return Vec3{x * (1 + 0.2 * std::sin(9 * y)), y * (1 + 0.2 * std::sin(8 * x)), 0.001 * x};
  };
  for (const double lift : {0.0003, 0.01}) {
    Mesh old = grid(14, 14, false, sheet);
    const auto other = [&](double u, double v) {
      const Vec3 p = sheet(u, v);
      return Vec3{0.96 * p.x + 0.1 * p.y, p.y, p.z + lift * p.x};
    };
    add(old, grid(9, 11, false, other), {0.005, 0.0035, 0});
    const Remeshed result = remesh(old, 0.1);
    double least = 1;
    for (std::size_t i = 0; i < result.mesh.positions.size(); ++i)
      for (std::size_t k = 0; k < i; ++k)
        least = std::min(least, length(result.mesh.positions[i] - result.mesh.positions[k]));
    EXPECT_GT(least, 1e-8);  // a 2^-20th of an edge is 1e-7
  }
}

std::string refusal(const Mesh& mesh, double edge_length) {
  try {
    remesh(mesh, edge_length);
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Remesh, RefusesWhatItCannotDo) {
  Mesh fan{{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {-1, 1, 0}, {-1, -1, 0}}, {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}}};
  EXPECT_NE(refusal(fan, 0.1).find("is no manifold"), std::string::npos);
  const Mesh turned{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}, {{0, 1, 2}, {1, 2, 3}}};
  EXPECT_NE(refusal(turned, 0.1).find("is no manifold"), std::string::npos);
  const Mesh touching{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}}, {{0, 1, 2}, {0, 3, 4}}};
  EXPECT_NE(refusal(touching, 0.1).find("is no manifold"), std::string::npos);
  EXPECT_NE(refusal(sheet(), 1e-5).find("triangles"), std::string::npos);
}

}  // namespace
}  // namespace isochron
