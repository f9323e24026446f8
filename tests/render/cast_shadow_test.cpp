// Shadows of edges, cast from a point of a lamp: lengths of paths that graze an edge, and where along it these lengths are found.
#include "core/techniques/cast_shadow.h"

#include <gtest/gtest.h>

#include "support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// A tilted floor of two triangles, seen from either side.
struct Setting {
  Scene scene;
  Vec3 lamp, eye;
  BoundaryEdge edge;

  explicit Setting(Rng& rng) {
    const auto around = [&](const Vec3& p, double r) {
      return p + Vec3(rng.uniform() - 0.5, rng.uniform() - 0.5, rng.uniform() - 0.5) * (2 * r);
    };
    const double side = rng.uniform() < 0.5 ? -1 : 1;
    add_shape(scene, "floor", quad({-2, 0.1, 2}, {2, 0.1, 2}, {2, 0, -2}, {-2, 0, -2}), diffuse(Rgb(0.7), true));
    add_shape(scene, "lamp", quad({9, 9, 9}, {9, 9, 10}, {9, 10, 10}, {9, 10, 9}), diffuse(Rgb(0)), Rgb(1));
    lamp = around({0, 2 * side, 0}, 0.8);
    eye = around({0, 1.5 * side, 2}, 0.5);
    edge.origin = around({0, 0.6 * side, 0}, 0.4);
    edge.end = around({0, 0.6 * side, 0}, 0.4);
  }
  /// The lamp's point, which shines at the floor.
  SurfacePoint shining() const { return {lamp, {0, lamp.y > 0 ? -1.0 : 1.0, 0}, 2}; }
  /// Where the line through s of the edge meets a triangle's plane.
  Vec3 shadow(const PreparedScene& prepared, int triangle, double s) const {
    const double h = prepared.height_over(triangle, lamp), h_y = prepared.height_over(triangle, edge.point(s));
    return lamp + (edge.point(s) - lamp) * (h / (h - h_y));
  }
  double path_length(const PreparedScene& prepared, int triangle, double s) const {
    const Vec3 d = shadow(prepared, triangle, s);
    return length(d - lamp) + length(d - eye);
  }
};

bool inside(const PreparedScene& prepared, int triangle, const Vec3& p) {
  const auto corners = prepared.corners(triangle);
  for (int i = 0; i < 3; ++i)
    if (!(dot(cross(corners[(i + 1) % 3] - corners[i], p - corners[i]), prepared.normal(triangle)) > 0)) return false;
  return true;
}

TEST(CastShadow, FindsLengthsWhereTheyAre) {
  Rng rng(Stream{test_seed(1), 0, 0}, 0, 0);
  int roots = 0, others = 0;
  for (int i = 0; i < 2000; ++i) {
    const Setting setting(rng);
    const PreparedScene prepared(setting.scene, nullptr);
    for (const int t : {0, 1}) {
      const CastShadow shadow(prepared, setting.shining(), setting.edge, t);
      const double s = rng.uniform(), tau = setting.path_length(prepared, t, s), h = 1e-6;
      const auto found = shadow.at_length(setting.eye, tau);
      ASSERT_TRUE(found);
      EXPECT_LT(std::min(std::abs((*found)[0] - s), std::abs((*found)[1] - s)), 1e-6);
      for (const double root : *found) {
        if (!(root > 0 && root < 1)) continue;
        EXPECT_NEAR(setting.path_length(prepared, t, root), tau, 1e-9 * tau);
        ++(std::abs(root - s) < 1e-6 ? roots : others);
      }
      const double rate = (setting.path_length(prepared, t, s + h) - setting.path_length(prepared, t, s - h)) / (2 * h);
      EXPECT_NEAR(shadow.length_rate(setting.eye, s), std::abs(rate), 1e-5 * (1 + std::abs(rate)));
    }
  }
  EXPECT_GE(roots, 4000);
  EXPECT_GT(others, 50);  // circles that a shadow crosses twice
}

TEST(CastShadow, KnowsThePartInATriangle) {
  Rng rng(Stream{test_seed(2), 0, 0}, 0, 0);
  int partly = 0;
  for (int i = 0; i < 2000; ++i) {
    const Setting setting(rng);
    const PreparedScene prepared(setting.scene, nullptr);
    for (const int t : {0, 1}) {
      const CastShadow shadow(prepared, setting.shining(), setting.edge, t);
      constexpr int kPoints = 64;
      int hits = 0;
      for (int k = 0; k < kPoints; ++k) {
        const double s = (k + 0.5) / kPoints;
        const bool hit = inside(prepared, t, setting.shadow(prepared, t, s));
        EXPECT_EQ(shadow.within(s), hit);
        hits += hit;
      }
      EXPECT_NEAR(shadow.part(), static_cast<double>(hits) / kPoints, 1.01 / kPoints);
      partly += shadow.part() > 0 && shadow.part() < 1;
    }
  }
  EXPECT_GT(partly, 300);
}

/// Beyond the plane, or behind the lamp, an edge casts no shadow on it.
TEST(CastShadow, NeedsTheEdgeBetween) {
  Rng rng(Stream{test_seed(3), 0, 0}, 0, 0);
  Setting setting(rng);
  const PreparedScene prepared(setting.scene, nullptr);
  const Vec3 down = (setting.lamp.y > 0 ? 1 : -1) * Vec3(0, 1, 0);
  for (const double beyond : {-3.0, 4.0}) {
    setting.edge.origin = setting.lamp * 0.1 + down * beyond;
    setting.edge.end = setting.edge.origin + Vec3(0.3, 0, 0.1);
    for (const int t : {0, 1}) EXPECT_EQ(CastShadow(prepared, setting.shining(), setting.edge, t).part(), 0) << beyond;
  }
}

}  // namespace
}  // namespace isochron::testing
