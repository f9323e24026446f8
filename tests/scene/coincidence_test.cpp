#include "core/scene/coincidence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include "tests/render/scene_building.h"
#include "tests/seed.h"

namespace isochron {
namespace {

using testing::add_shape;
using testing::box;
using testing::diffuse;
using testing::quad;

/// (first shape, second shape, triangles) of each.
std::vector<std::array<int, 3>> found_in(const Scene& scene) {
  std::vector<std::array<int, 3>> all;
  for (const Coincidence& c : find_coincidences(scene)) all.push_back({c.shape[0], c.shape[1], c.triangles});
  return all;
}

using Found = std::vector<std::array<int, 3>>;

TEST(Coincidence, SameCornersInAnyOrder) {
  const Vec3 a{0, 0, 0}, b{1, 0, 0.3}, c{0.2, 1, 0}, d{0, 0, 1};
  const Vec3 minus_zero{-0.0, 0, -0.0};
  for (std::array<Vec3, 3> corners : {std::array<Vec3, 3>{a, b, c}, {minus_zero, b, c}}) {
    std::array<int, 3> order{0, 1, 2};
    do {
      Scene scene;
      add_shape(scene, "one", {{a, b, c}, {{0, 1, 2}}}, diffuse(Rgb(0.5)));
      add_shape(scene, "between", {{a, b, d}, {{0, 1, 2}}}, diffuse(Rgb(0.5)));
      add_shape(scene, "other", {{corners[order[0]], corners[order[1]], corners[order[2]]}, {{0, 1, 2}}},
                diffuse(Rgb(0.5)));
      EXPECT_EQ(found_in(scene), (Found{{0, 2, 1}}));
    } while (std::next_permutation(order.begin(), order.end()));
  }
}

TEST(Coincidence, NeighboursAndNearlyEqualOnesAreNone) {
  Scene scene;
  add_shape(scene, "cube", box({0, 0, 0}, {1, 1, 1}), diffuse(Rgb(0.5)));
  add_shape(scene, "beside", box({1, 0, 0}, {2, std::nextafter(1.0, 2.0), 1}), diffuse(Rgb(0.5)));
  add_shape(scene, "on top", quad({0, 1, 0}, {0, 1, 0.5}, {1, 1, 0.5}, {1, 1, 0}), diffuse(Rgb(0.5)));
  EXPECT_TRUE(find_coincidences(scene).empty());
  EXPECT_EQ(coincidence_warning(scene), "");
}

TEST(Coincidence, CountsTrianglesPerPair) {
  Scene scene;
  add_shape(scene, "floor", quad({0, 0, 0}, {0, 0, 1}, {1, 0, 1}, {1, 0, 0}), diffuse(Rgb(0.5)));
  add_shape(scene, "cube", box({0, 0, 0}, {1, 1, 1}), diffuse(Rgb(0.5)));  // its bottom is cut the same way
  add_shape(scene, "shell", box({0, 0, 0}, {1, 1, 1}, true), diffuse(Rgb(0.5)));
  EXPECT_EQ(found_in(scene), (Found{{0, 1, 2}, {1, 2, 12}}));
  EXPECT_EQ(coincidence_warning(scene),
            "shapes on the same surface: 'floor' and 'cube' (2 triangles), 'cube' and 'shell' (12 triangles); "
            "light would be reflected by either or by both, so images are wrong there: leave one out, or move "
            "them apart");
}

TEST(Coincidence, NamesAFewPairs) {
  Scene scene;
  for (int i = 0; i < 7; ++i)
    add_shape(scene, std::string(1, static_cast<char>('a' + i)), {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}},
              diffuse(Rgb(0.5)));
  const std::string text = coincidence_warning(scene);
  EXPECT_NE(text.find("'d' and 'e' (1 triangle) and 2 more pairs;"), std::string::npos) << text;
}

/// Triangles between a few points, against looking for the last one before each that has the same points.
TEST(Coincidence, MatchesBruteForce) {
  const Vec3 points[6] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 1, 0}, {0, 1, 1}};
  std::mt19937 random(test_seed(5));
  std::array<int, 6> order{0, 1, 2, 3, 4, 5};
  Scene scene;
  std::vector<std::set<int>> corners;
  Found expected;
  for (int s = 0; s < 40; ++s) {
    std::shuffle(order.begin(), order.end(), random);
    corners.push_back({order[0], order[1], order[2]});
    add_shape(scene, std::to_string(s), {{points[order[0]], points[order[1]], points[order[2]]}, {{0, 1, 2}}},
              diffuse(Rgb(0.5)));
    for (int before = s - 1; before >= 0; --before) {
      if (corners[before] != corners[s]) continue;
      expected.push_back({before, s, 1});
      break;
    }
  }
  std::sort(expected.begin(), expected.end());
  EXPECT_GT(expected.size(), 10u);
  EXPECT_EQ(found_in(scene), expected);
}

}  // namespace
}  // namespace isochron
