#include "core/scene/polygon.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "core/base/constants.h"
#include "core/scene/mesh.h"
#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

std::vector<int> all(std::size_t count) {
  std::vector<int> corners(count);
  std::iota(corners.begin(), corners.end(), 0);
  return corners;
}

Vec3 area_vector(const std::vector<Vec3>& p, const std::vector<std::array<int, 3>>& triangles, double& sum) {
  Vec3 total;
  sum = 0;
  for (const auto& t : triangles) {
    const Vec3 area = 0.5 * cross(p[t[1]] - p[t[0]], p[t[2]] - p[t[0]]);
    total += area;
    sum += length(area);
  }
  return total;
}

/// The triangles cover the polygon: their area is its area, all face its way (so none lies on another), and their
/// sides without a neighbour are its own.
void expect_cut(const std::vector<Vec3>& points, const std::vector<int>& corners, double flatness = 1e-6) {
  std::vector<std::array<int, 3>> triangles;
  ASSERT_EQ(cut_polygon(points, corners, triangles), "");
  ASSERT_EQ(triangles.size(), corners.size() - 2);
  Vec3 newell;
  for (std::size_t i = 0; i < corners.size(); ++i)
    newell += 0.5 * cross(points[corners[i]], points[corners[(i + 1) % corners.size()]]);
  double sum = 0;
  const Vec3 total = area_vector(points, triangles, sum);
  EXPECT_LE(length(total - newell), 1e-6 * length(newell));
  EXPECT_NEAR(sum, length(newell), flatness * length(newell));
  std::map<std::pair<int, int>, int> sides;  // how often more upwards than downwards in number
  const auto add = [&](int a, int b, int sign) { sides[std::minmax(a, b)] += a < b ? sign : -sign; };
  for (const auto& t : triangles)
    for (int i = 0; i < 3; ++i) add(t[i], t[(i + 1) % 3], 1);
  for (std::size_t i = 0; i < corners.size(); ++i) add(corners[i], corners[(i + 1) % corners.size()], -1);
  for (const auto& [side, count] : sides) EXPECT_EQ(count, 0) << side.first << " " << side.second;
}

/// Tilts and moves points of the plane, rounded to float as of a file.
std::vector<Vec3> tilted(const std::vector<std::array<double, 2>>& flat, double angle) {
  std::vector<Vec3> points;
  for (const auto& [x, y] : flat) {
    const Vec3 p{x, y * std::cos(angle), y * std::sin(angle)};
    const Vec3 q{p.x * std::cos(1.3 * angle) + p.z * std::sin(1.3 * angle), p.y,
                 p.z * std::cos(1.3 * angle) - p.x * std::sin(1.3 * angle)};
    const auto rounded = [](double v) { return static_cast<double>(static_cast<float>(v)); };
    points.push_back({rounded(q.x + 7), rounded(q.y - 3), rounded(q.z + 1)});
  }
  return points;
}

const std::vector<std::array<double, 2>> kL{{0, 0}, {2, 0}, {2, 1}, {1, 1}, {1, 3}, {0, 3}};

std::vector<std::array<double, 2>> star(int points) {
  std::vector<std::array<double, 2>> flat;
  for (int i = 0; i < 2 * points; ++i) {
    const double r = i % 2 ? 0.3 : 1, a = kPi * i / points + 0.1;
    flat.push_back({r * std::cos(a), r * std::sin(a)});
  }
  return flat;
}

TEST(Polygon, ConcaveShapesAreCoveredFromEveryCornerInBothOrientations) {
  for (const auto& flat : {kL, star(5), star(12)})
    for (const double angle : {0.0, 0.4, 1.5, 2.6, 4.0}) {
      const std::vector<Vec3> points = tilted(flat, angle);
      std::vector<int> corners = all(points.size());
      for (std::size_t first = 0; first < points.size(); ++first) {
        std::rotate(corners.begin(), corners.begin() + 1, corners.end());
        expect_cut(points, corners);
        expect_cut(points, {corners.rbegin(), corners.rend()});
      }
    }
}

TEST(Polygon, CornersOnStraightSidesAreKept) {
  const std::vector<Vec3> square{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0},
                                 {2, 2, 0}, {1, 2, 0}, {0, 2, 0}, {0, 1, 0}};
  std::vector<int> corners = all(square.size());
  for (std::size_t first = 0; first < corners.size(); ++first) {
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    expect_cut(square, corners);
  }
  expect_cut({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {1, 1, 0}}, all(4));
}

TEST(Polygon, SlightlyBentOnesAreCutAlongTheirNormal) {
  for (const double bend : {0.01, 0.1}) {
    std::vector<Vec3> points = tilted(kL, 0.7);
    for (std::size_t i = 0; i < points.size(); ++i) points[i].y += bend * std::sin(3.0 * static_cast<double>(i));
    expect_cut(points, all(points.size()), 5 * bend);
  }
}

TEST(Polygon, HolesJoinedToTheOutline) {
  // A square with a square hole, joined by a side that is gone both ways.
  const std::vector<Vec3> p{{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {1, 1, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}};
  expect_cut(p, {0, 1, 2, 3, 0, 4, 5, 6, 7, 4});
}

TEST(Polygon, ConvexOnesAreFansAndRepeatedCornersCostNothing) {
  const std::vector<Vec3> p{{0, 0, 0}, {2, 0, 0}, {3, 1, 0}, {2, 2, 0}, {0, 2, 0}, {2, 2, 0}};
  std::vector<std::array<int, 3>> triangles;
  EXPECT_EQ(cut_polygon(p, {0, 1, 1, 2, 3, 5, 4, 0}, triangles), "");
  EXPECT_EQ(triangles, (std::vector<std::array<int, 3>>{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(Polygon, NothingIsLeftOfOnesWithoutArea) {
  const std::vector<Vec3> p{{0, 0, 0}, {1, 1, 1}, {3, 3, 3}, {2, 2, 2}};
  std::vector<std::array<int, 3>> triangles;
  EXPECT_EQ(cut_polygon(p, {0, 1, 2, 3}, triangles), "");
  EXPECT_EQ(cut_polygon(p, {0, 1, 0, 1, 0}, triangles), "");
  EXPECT_TRUE(triangles.empty());
}

TEST(Polygon, OnesThatCrossThemselvesAreRefused) {
  std::vector<std::array<int, 3>> triangles;
  EXPECT_EQ(cut_polygon({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}, all(4), triangles), "crosses itself");
  EXPECT_EQ(cut_polygon({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1.5, 0}}, all(4), triangles), "crosses itself");
  std::vector<Vec3> pentagram;
  for (int i = 0; i < 5; ++i) pentagram.push_back({std::cos(0.8 * kPi * i), std::sin(0.8 * kPi * i), 0});
  EXPECT_EQ(cut_polygon(pentagram, all(5), triangles), "crosses itself");
  TemporaryFolder folder;
  folder.write("bow.obj", "v 0 0 0\nv 1 1 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 5\nf 1 2 3 4\n");
  EXPECT_EQ(error_of([&] { read_mesh(folder.path("bow.obj")); }),
            folder.path("bow.obj") + ": the face of 4 corners that begins at (0, 0, 0) crosses itself");
}

TEST(Polygon, MeshFilesOfEveryKindAreCutAlike) {
  TemporaryFolder folder;
  const std::string points = "0 0 0\n2 0 0\n2 1 0\n1 1 0\n1 3 0\n0 3 0\n";
  folder.write("l.obj", "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 3 0\nv 0 3 0\nf 3 4 5 6 1 2\n");
  folder.write("l.off", "OFF\n6 1 0\n" + points + "6 2 3 4 5 0 1\n");
  folder.write("l.ply",
               "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n"
               "element face 1\nproperty list uchar int vertex_indices\nend_header\n" +
                   points + "6 2 3 4 5 0 1\n");
  for (const char* name : {"l.obj", "l.off", "l.ply"}) {
    const Mesh mesh = read_mesh(folder.path(name));
    double sum = 0;
    const Vec3 total = area_vector(mesh.positions, mesh.faces, sum);
    EXPECT_DOUBLE_EQ(total.z, 4) << name;  // the fan around (2, 1) covers more
    EXPECT_DOUBLE_EQ(sum, 4) << name;
  }
}

}  // namespace
}  // namespace isochron
