#include "optim/reconstruct/first_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <utility>

#include "optim/reconstruct/sheet_maxima.h"
#include "tests/reconstruct/simulated.h"

namespace isochron {
namespace {

constexpr double kPs = 0.299792458e-3;

FirstSurface surface_of(const std::vector<HiddenPatch>& patches, int points = 24) {
  std::mt19937 random(test_seed(11));
  return first_surface(
      back_project(counted(expected_counts(square_wall(points, 0.5), patches, 250, 20 * kPs, 1000), 0.2, random)));
}

std::vector<HiddenPatch> operator+(std::vector<HiddenPatch> a, const std::vector<HiddenPatch>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

/// Area of the faces whose middles lie between these depths, seen from the wall.
double area_between(const Mesh& mesh, double low, double high) {
  double area = 0;
  for (const auto& face : mesh.faces) {
    const Vec3 &a = mesh.positions[face[0]], &b = mesh.positions[face[1]], &c = mesh.positions[face[2]];
    const double depth = (a.z + b.z + c.z) / 3;
    if (depth > low && depth < high) area += -0.5 * cross(b - a, c - a).z;
  }
  return area;
}

void expect_clean(const FirstSurface& surface) {
  ASSERT_EQ(surface.albedo.size(), surface.mesh.positions.size());
  std::map<std::pair<int, int>, int> edges;
  for (const auto& face : surface.mesh.faces) {
    const Vec3 &a = surface.mesh.positions[face[0]], &b = surface.mesh.positions[face[1]],
               &c = surface.mesh.positions[face[2]];
    EXPECT_LT(cross(b - a, c - a).z, 0) << "does not face the wall";
    for (int k = 0; k < 3; ++k) EXPECT_EQ(++edges[std::pair(face[k], face[(k + 1) % 3])], 1);
  }
}

TEST(FirstSurface, APlateHasItsDepthItsOutlineAndAnEvenAlbedo) {
  const FirstSurface surface = surface_of(plate({0.03, -0.02, 0.4}, 0.2, 0.16, 0.005));
  expect_clean(surface);
  const double area = area_between(surface.mesh, 0.39, 0.41);
  EXPECT_NEAR(area, area_between(surface.mesh, 0, 1), 1e-12) << "something beside the plate";
  // The border is right to a third of the distance of vertices, 14 mm, all around 0.72 m.
  EXPECT_NEAR(area, 0.2 * 0.16, 0.0046 * 0.72);
  for (std::size_t i = 0; i < surface.albedo.size(); ++i) {
    const Vec3& p = surface.mesh.positions[i];
    if (std::abs(p.x - 0.03) < 0.07 && std::abs(p.y + 0.02) < 0.05) {
      EXPECT_NEAR(p.z, 0.4, 0.0015);
      EXPECT_NEAR(surface.albedo[i], 1.2, 0.4);
    }
  }
}

TEST(FirstSurface, SheetsAreCutWhereTheDepthJumps) {
  const FirstSurface surface =
      surface_of(plate({-0.08, 0, 0.4}, 0.12, 0.2, 0.005) + plate({0.08, 0, 0.5}, 0.12, 0.2, 0.005));
  expect_clean(surface);
  const double near = area_between(surface.mesh, 0.39, 0.41), far = area_between(surface.mesh, 0.49, 0.51);
  EXPECT_NEAR(near, 0.024, 0.005);
  EXPECT_NEAR(far, 0.024, 0.005);
  EXPECT_NEAR(area_between(surface.mesh, 0, 1), near + far, 1e-12) << "faces across the jump";
}

TEST(FirstSurface, WhatIsSeenBehindIsASheetOfItsOwn) {
  const FirstSurface surface =
      surface_of(plate({0, 0, 0.35}, 0.06, 0.06, 0.003) + plate({0, 0, 0.5}, 0.24, 0.24, 0.006));
  expect_clean(surface);
  EXPECT_NEAR(area_between(surface.mesh, 0.34, 0.36), 0.0036, 0.002);
  EXPECT_NEAR(area_between(surface.mesh, 0.49, 0.51), 0.0576, 0.01);
}

TEST(FirstSurface, MaximaLieBetweenVoxels) {
  BackProjection volume;
  volume.across = volume.up = {0, 1, 2};
  volume.depth = {0, 1, 2, 3, 4, 5, 6};
  volume.least_albedo = volume.least_significance = 1;
  volume.significance.assign(63, 2);
  for (const double depth : volume.depth) {
    const double x = depth - 2.3;
    for (int i = 0; i < 9; ++i) volume.albedo.push_back(static_cast<float>(10 - x * x));
  }
  const auto maxima = sheet_maxima(volume);
  for (const auto& line : maxima) {
    ASSERT_EQ(line.size(), 1u);
    EXPECT_NEAR(line[0].depth, 2.3, 1e-5);
    EXPECT_NEAR(line[0].albedo, 10, 1e-5);
    EXPECT_NEAR(line[0].border, 5, 0.5);
  }
  volume.significance.assign(63, 0.5);
  for (const auto& line : sheet_maxima(volume)) EXPECT_TRUE(line.empty());
}

TEST(FirstSurface, IsEmptyWhereNothingIsSignificant) {
  const FirstSurface surface = first_surface(BackProjection());
  EXPECT_TRUE(surface.mesh.positions.empty());
  EXPECT_TRUE(surface.depth.empty());
}

}  // namespace
}  // namespace isochron
