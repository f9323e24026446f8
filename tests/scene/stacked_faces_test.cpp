// Faces that lie on each other: which are found, and the warning that names their shapes.
#include "core/scene/stacked_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/render/scene_building.h"
#include "tests/seed.h"

namespace isochron {
namespace {

using testing::add_shape;
using testing::box;
using testing::diffuse;
using testing::quad;
using Pairs = std::vector<std::array<int, 2>>;

Pairs found_in(const Scene& scene) {
  StackedFaces stacked;
  stacked.update(scene, std::vector<char>(scene.shapes.size(), 1), 1e-6);
  return stacked.between_shapes();
}

Pairs found_in(const Mesh& mesh) {
  return stacked_faces(mesh.positions, mesh.faces);
}

const std::vector<Vec3> kCard{{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};

TEST(StackedFaces, OfACardThatIsTwiceInItsMesh) {
  EXPECT_EQ(found_in(Mesh{kCard, {{0, 1, 2}, {0, 2, 3}}}), Pairs());
  EXPECT_EQ(found_in(Mesh{kCard, {{0, 1, 2}, {0, 2, 3}, {0, 3, 2}, {0, 2, 1}}}), (Pairs{{0, 3}, {1, 2}})) << "a back";
  EXPECT_EQ(found_in(Mesh{kCard, {{0, 1, 2}, {0, 2, 3}, {1, 2, 3}, {1, 3, 0}}}),
            (Pairs{{0, 2}, {0, 3}, {1, 2}, {1, 3}}))
      << "cut along the other diagonal";
}

TEST(StackedFaces, NeighboursAndWhatTouchesAreNone) {
  Scene scene;
  add_shape(scene, "cube", box({0, 0, 0}, {1, 1, 1}), diffuse(Rgb(0.5)));
  add_shape(scene, "beside, in the plane of its top", quad({1, 1, 0}, {1, 1, 1}, {2, 1, 1}, {2, 1, 0}),
            diffuse(Rgb(0.5)));
  add_shape(scene, "over it", quad({0, 1.00001, 0}, {0, 1.00001, 1}, {1, 1.00001, 1}, {1, 1.00001, 0}),
            diffuse(Rgb(0.5)));
  EXPECT_EQ(found_in(scene), Pairs());
  EXPECT_EQ(scene.stacked, Pairs());
  EXPECT_EQ(stacked_warning(scene), "");
}

/// A patch somewhere in the plane of a floor, and turned in it, against random points that both hold.
TEST(StackedFaces, MatchBruteForce) {
  std::mt19937 random(test_seed(5));
  std::uniform_real_distribution<double> uniform(-1, 1);
  const Vec3 normal = normalize(Vec3{0.2, 1, -0.3}), s = normalize(cross(normal, Vec3{0, 0, 1})), t = cross(normal, s);
  const auto inside = [&](const Mesh& mesh, const std::array<int, 3>& f, const Vec3& p) {
    int positive = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 &a = mesh.positions[f[k]], &b = mesh.positions[f[(k + 1) % 3]];
      positive += dot(normal, cross(b - a, p - a)) > 0;
    }
    return positive % 3 == 0;
  };
  int common = 0, apart = 0;
  for (int repeat = 0; repeat < 200; ++repeat) {
    Mesh mesh;
    for (int i = 0; i < 6; ++i) mesh.positions.push_back(s * uniform(random) + t * uniform(random) + normal * 0.7);
    mesh.faces = {{0, 1, 2}, {3, 4, 5}};
    int hits = 0;
    constexpr int kPoints = 4000;
    for (int i = 0; i < kPoints; ++i) {
      const Vec3 p = s * uniform(random) + t * uniform(random) + normal * 0.7;
      hits += inside(mesh, mesh.faces[0], p) && inside(mesh, mesh.faces[1], p);
    }
    if (hits > 0) {
      EXPECT_EQ(found_in(mesh).size(), 1u) << repeat;
    }
    // A part that so many points miss may still be there.
    (hits > 0 ? common : apart) += 1;
    for (Vec3& p : mesh.positions) p += (&p - mesh.positions.data()) > 2 ? normal * 1e-4 : Vec3();
    EXPECT_EQ(found_in(mesh), Pairs()) << "one above the other";
  }
  EXPECT_GT(common, 50);
  EXPECT_GT(apart, 20);
}

/// Many faces, so that space is divided: a field twice, the second with cells of another size.
TEST(StackedFaces, OfFieldsOfManyFaces) {
  const auto height = [](double x, double z) { return 0.1 * x * z; };
  const Mesh field = testing::height_field(40, 40, -1, 1, height), other = testing::height_field(30, 30, -1, 1, height);
  const auto joined = [](Mesh mesh, const Mesh& with) {
    const int first = static_cast<int>(mesh.positions.size());
    mesh.positions.insert(mesh.positions.end(), with.positions.begin(), with.positions.end());
    for (const auto& f : with.faces) mesh.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
    return mesh;
  };
  const Pairs all = found_in(joined(field, field));
  const int faces = static_cast<int>(field.faces.size());
  ASSERT_EQ(all.size(), field.faces.size());
  for (int i = 0; i < faces; ++i) EXPECT_EQ(all[i], (std::array{i, i + faces}));
  EXPECT_LT(found_in(joined(field, other)).size(), 30u) << "curved: they cross along lines, and touch at few points";
  const auto flat = [](double, double) { return 0.3; };
  EXPECT_GT(
      found_in(joined(testing::height_field(40, 40, -1, 1, flat), testing::height_field(31, 31, -1, 1, flat))).size(),
      3000u);
}

TEST(StackedFaces, FollowShapesThatMove) {
  Scene scene;
  add_shape(scene, "floor", quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}), diffuse(Rgb(0.5)));
  add_shape(scene, "patch", quad({3, 0, 1}, {4, 0, 1}, {4, 0, 0}, {3, 0, 0}), diffuse(Rgb(0.5)));
  add_shape(scene, "still", quad({-1, 2, 1}, {1, 2, 1}, {1, 2, -1}, {-1, 2, -1}), diffuse(Rgb(0.5)));
  StackedFaces kept;
  kept.update(scene, {1, 1, 1}, 1e-6);
  EXPECT_TRUE(kept.empty());
  const auto move = [&](const Vec3& by) {
    for (int v = 4; v < 8; ++v) scene.positions[v] += by;
    kept.update(scene, {0, 1, 0}, 1e-6);
    EXPECT_EQ(kept.between_shapes(), found_in(scene));
  };
  move({-3.2, 0, 0});
  EXPECT_FALSE(kept.of(0).empty());
  EXPECT_FALSE(kept.of(2).empty());
  EXPECT_TRUE(kept.of(4).empty());
  move({0, 2, 0});
  EXPECT_TRUE(kept.of(0).empty());
  EXPECT_FALSE(kept.of(4).empty());
  move({0, 1, 0});
  EXPECT_TRUE(kept.empty());
}

TEST(StackedFaces, WarningNamesShapesThatFaceTheSameWay) {
  Scene scene;
  add_shape(scene, "floor", quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}), diffuse(Rgb(0.5)));
  add_shape(scene, "cube that stands on it", box({0.2, 0, 0.2}, {0.6, 1, 0.6}), diffuse(Rgb(0.5)));
  EXPECT_FALSE(found_in(scene).empty());
  EXPECT_EQ(stacked_warning(scene), "");
  add_shape(scene, "patch", quad({-0.8, 0, 0.8}, {-0.1, 0, 0.8}, {-0.1, 0, 0.2}, {-0.8, 0, 0.2}), diffuse(Rgb(0.5)));
  EXPECT_EQ(stacked_warning(scene),
            "shapes on the same surface: 'patch' on 'floor' (2 triangles); of two the one that comes later in the file "
            "is seen there");
}

TEST(StackedFaces, WarningNamesAFewPairs) {
  Scene scene;
  for (int i = 0; i < 4; ++i)
    add_shape(scene, std::string(1, static_cast<char>('a' + i)), {{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}, {{0, 1, 2}}},
              diffuse(Rgb(0.5)));
  const std::string text = stacked_warning(scene);
  EXPECT_NE(text.find("'c' on 'b' (1 triangle) and 2 more pairs;"), std::string::npos) << text;
}

}  // namespace
}  // namespace isochron
