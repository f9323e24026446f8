// What a query of the hierarchy costs as the mesh gets finer, from 10 triangles to a million, counted in
// nodes and leaves visited: no more than one per crossing triangle and a few times the hierarchy's depth.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/base/constants.h"
#include "core/geometry/ellipsoid_bvh.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// A rippled torus of 2 * rows * columns triangles.
std::vector<EllipsoidBvh::Input> torus(int rows, int columns) {
  const auto point = [&](int i, int j) {
    const double p = kTwoPi * i / rows, t = kTwoPi * j / columns;
    const double r = 0.4 * (1 + 0.1 * std::sin(3 * p) * std::cos(2 * t));
    return Vec3{(1 + r * std::cos(t)) * std::cos(p), (1 + r * std::cos(t)) * std::sin(p), r * std::sin(t)};
  };
  std::vector<EllipsoidBvh::Input> triangles;
  triangles.reserve(static_cast<std::size_t>(2 * rows * columns));
  for (int i = 0; i < rows; ++i)
    for (int j = 0; j < columns; ++j) {
      const int id = static_cast<int>(triangles.size());
      triangles.push_back({{point(i, j), point(i + 1, j), point(i, j + 1)}, id});
      triangles.push_back({{point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)}, id + 1});
    }
  return triangles;
}

TEST(QueryCost, GrowsWithTheCrossingTrianglesAndTheDepth) {
  constexpr int kQueries = 200;
  double crossing_before = 0;
  for (const int side : {1, 2, 5, 16, 50, 158, 500, 708}) {  // 4 to 1 002 528 triangles
    const auto triangles = torus(side, side);
    const EllipsoidBvh bvh(triangles);
    std::mt19937_64 rng(test_seed(3));
    std::uniform_real_distribution<double> uniform(-2, 2);
    const auto vec = [&] {
      const double x = uniform(rng), y = uniform(rng), z = uniform(rng);
      return Vec3{x, y, z};
    };
    double crossing = 0, visited = 0, pair_crossing = 0, pair_visited = 0;
    std::vector<int> ids;
    for (int k = 0; k < kQueries; ++k) {
      const Vec3 a = vec(), b = vec(), target{1.4, 0, 0};
      const double tau = length(target - a) + length(target - b);
      ids.clear();
      visited += bvh.query(a, b, tau, tau, ids) / static_cast<double>(kQueries);
      crossing += static_cast<double>(ids.size()) / kQueries;
      ids.clear();
      pair_visited += bvh.query_surfaces(a, b, 0.98 * tau, tau, ids) / static_cast<double>(kQueries);
      pair_crossing += static_cast<double>(ids.size()) / kQueries;
    }
    const auto count = static_cast<double>(triangles.size());
    std::printf("%8.0f triangles: crossing %7.1f visited %6.1f, two lengths: crossing %7.1f visited %6.1f\n", count,
                crossing, visited, pair_crossing, pair_visited);
    EXPECT_LE(visited, crossing + 3 * std::log2(count)) << count << " triangles";
    EXPECT_LE(pair_visited, pair_crossing + 6 * std::log2(count)) << count << " triangles";
    // Crossing triangles themselves grow like the square root of all: the ellipse is a curve on the mesh.
    if (count > 1000) {
      EXPECT_LT(crossing, 5 * std::sqrt(count));
    }
    EXPECT_GT(crossing, crossing_before);
    crossing_before = crossing;
  }
}

}  // namespace
}  // namespace isochron
