#include "core/geometry/ellipsoid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <vector>

#include "core/base/constants.h"
#include "tests/geometry/random_cases.h"
#include "tests/geometry/reference_ellipse.h"

namespace isochron {
namespace {

double sum_of_distances(const Ellipsoid& e, const Vec3& q) {
  return length(q - e.a) + length(q - e.b);
}

TEST(Ellipsoid, SemiAxes) {
  const Ellipsoid e({1, 2, 3}, {4, 6, 3}, 13);
  EXPECT_TRUE(e.valid());
  EXPECT_DOUBLE_EQ(e.major, 6.5);
  EXPECT_DOUBLE_EQ(e.minor, 6);
  EXPECT_NEAR(length(e.axis - Vec3{0.6, 0.8, 0}), 0, 1e-15);
  EXPECT_FALSE(Ellipsoid({0, 0, 0}, {1, 0, 0}, 1).valid());
  EXPECT_FALSE(Ellipsoid({0, 0, 0}, {1, 0, 0}, 0.5).valid());
  EXPECT_FALSE(Ellipsoid({0, 0, 0}, {0, 0, 0}, 0).valid());
  EXPECT_FALSE(Ellipsoid({0, 0, 0}, {1, 0, 0}, std::numeric_limits<double>::infinity()).valid());
  EXPECT_FALSE(Ellipsoid({0, 0, 0}, {std::nan(""), 0, 0}, 1).valid());
}

TEST(ClipEllipse, AgreesWithLongDoubleReference) {
  RandomCases random;
  int meeting = 0, several = 0, complete = 0, close_calls = 0, loose = 0;
  for (int k = 0; k < 100000; ++k) {
    const Triangle t = random.triangle();
    const Ellipsoid e = random.ellipsoid(t);
    const ReferenceEllipse reference(e, t);
    const long double expected = reference.span, margin = reference.margin;
    EllipseArcs arcs;
    const bool hit = clip_ellipse(e, t.v0, t.v1, t.v2, arcs);
    EXPECT_EQ(hit, arcs.count > 0);
    if (margin < 1e-9L) {
      ++close_calls;  // roots that nearly coincide: the span itself is ill-conditioned
      continue;
    }
    // Positions are good to round-off of the coordinates; in angle they are divided by the size of the
    // ellipse and, at grazing roots, by the square root of the margin.
    const double size = length(t.v1 - t.v0) + length(t.v2 - t.v0) + length(t.v0 - e.center) + e.tau;
    const double sliver = length_squared(t.v1 - t.v0) + length_squared(t.v2 - t.v0);
    const double tolerance = 1e-14 * size / e.minor * (sliver / t.area()) / static_cast<double>(margin);
    EXPECT_NEAR(arcs.total_span, static_cast<double>(expected), 1e-12 + tolerance) << "case " << k;
    double sum = 0;
    for (int i = 0; i < arcs.count; ++i) sum += arcs.span[i];
    EXPECT_NEAR(sum, arcs.total_span, 1e-14);
    loose += tolerance > 1e-6;
    meeting += hit, several += arcs.count > 1, complete += arcs.total_span == kTwoPi;
  }

  EXPECT_GT(meeting, 50000);
  EXPECT_GT(several, 1000);
  EXPECT_GT(complete, 300);
  EXPECT_LT(close_calls, 1000);
  EXPECT_LT(loose, 5000);
}

TEST(ClipEllipse, PointsLieOnEllipsoidAndInTriangle) {
  RandomCases random;
  for (int k = 0; k < 50000; ++k) {
    const Triangle t = random.triangle();
    const Ellipsoid e = random.ellipsoid(t);
    EllipseArcs arcs;
    if (!clip_ellipse(e, t.v0, t.v1, t.v2, arcs)) continue;
    const Vec3 area2 = cross(t.v1 - t.v0, t.v2 - t.v0);
    const double extent = length(t.v1 - t.v0) + length(t.v2 - t.v0);
    const double sine = length(area2) / (extent * extent);
    const double size = extent + length(t.v0 - e.center) + e.tau;
    for (const double u : {1e-6, 0.3, 0.77, 1 - 1e-6}) {
      const Vec3 q = arcs.point_at(u);
      EXPECT_NEAR(sum_of_distances(e, q), e.tau, 1e-14 * size) << "case " << k;
      EXPECT_NEAR(dot(area2, q - t.v0) / length(area2), 0, 1e-15 * size / sine) << "case " << k;
      const Vec3* v[3] = {&t.v0, &t.v1, &t.v2};
      for (int i = 0; i < 3; ++i) {
        const Vec3 inward = normalize(cross(area2, *v[(i + 1) % 3] - *v[i]));
        EXPECT_GT(dot(inward, q - *v[i]), -1e-14 * size / sine) << "case " << k;
      }
    }
  }
}

TEST(ClipEllipse, ArcsStartAndEndOnEdges) {
  RandomCases random;
  for (int k = 0; k < 20000; ++k) {
    const Triangle t = random.triangle();
    const Ellipsoid e = random.ellipsoid(t);
    EllipseArcs arcs;
    if (!clip_ellipse(e, t.v0, t.v1, t.v2, arcs) || arcs.total_span == kTwoPi) continue;
    const Vec3 area2 = cross(t.v1 - t.v0, t.v2 - t.v0);
    const double extent = length(t.v1 - t.v0) + length(t.v2 - t.v0);
    const double sine = length(area2) / (extent * extent);
    const double size = extent + length(t.v0 - e.center) + e.tau;
    const Vec3 v[3] = {t.v0, t.v1, t.v2};
    const auto nearest_edge = [&](double phi) {
      double best = std::numeric_limits<double>::infinity();
      int edge = -1;
      for (int i = 0; i < 3; ++i) {
        const double h = std::abs(dot(normalize(cross(area2, v[(i + 1) % 3] - v[i])), arcs.point(phi) - v[i]));
        if (h < best) best = h, edge = i;
      }
      // Grazing roots lose half of the digits along the ellipse but none across the edge.
      EXPECT_LT(best, 2e-14 * size / sine) << "case " << k;
      return edge;
    };
    int previous = -1;
    for (int i = 0; i < arcs.count; ++i) {
      const int edge = nearest_edge(arcs.start(i));
      if (sine > 0.05) {
        EXPECT_GT(edge, previous) << "arcs out of order in case " << k;
      }
      previous = edge;
      nearest_edge(arcs.start(i) + arcs.span[i]);
    }
  }
}

TEST(ClipEllipse, NearbyInputsGiveNearbyPoints) {
  // Equal random numbers on slightly different inputs. Where arcs appear, merge or shrink to nothing no order
  // can be continuous, and where an edge is grazed the ends move like the square root of the step: at steps
  // of 1e-9 those are a few in a thousand.
  RandomCases random;
  int compared = 0, far[3] = {};
  for (int k = 0; k < 50000; ++k) {
    const Triangle t = random.triangle();
    const Ellipsoid e = random.ellipsoid(t);
    EllipseArcs arcs, other[3];
    if (!clip_ellipse(e, t.v0, t.v1, t.v2, arcs)) continue;
    ++compared;
    const double step = 1e-9;
    const Vec3 shift = random.vec(step);
    const bool met[3] = {
        clip_ellipse(Ellipsoid(e.a, e.b, e.tau * (1 + step)), t.v0, t.v1, t.v2, other[0]),
        clip_ellipse(Ellipsoid(e.a + shift, e.b, e.tau), t.v0, t.v1, t.v2, other[1]),
        clip_ellipse(e, t.v0, t.v1 + shift, t.v2, other[2]),
    };
    const double size = e.tau + length(t.v1 - t.v0) + length(t.v2 - t.v0);
    for (int i = 0; i < 3; ++i) {
      double distance = 0;
      for (const double u : {0.01, 0.35, 0.8, 0.99})
        distance = std::max(distance, length(arcs.point_at(u) - other[i].point_at(u)));
      far[i] += !met[i] || !(distance < 30 * step * size);
    }
  }

  for (int i = 0; i < 3; ++i) EXPECT_LT(far[i], 0.01 * compared) << "input " << i;
  RecordProperty("compared", compared);
  RecordProperty("far", std::max({far[0], far[1], far[2]}));
}

TEST(ClipEllipse, SphereOnPlane) {
  // Coinciding foci at height 3 over the plane, radius 5: a circle of radius 4 about the foot point.
  EllipseArcs arcs;
  ASSERT_TRUE(clip_ellipse(Ellipsoid({0, 0, 3}, {0, 0, 3}, 10), {-20, -10, 0}, {20, -10, 0}, {0, 30, 0}, arcs));
  EXPECT_EQ(arcs.count, 1);
  EXPECT_EQ(arcs.start(0), 0);
  EXPECT_EQ(arcs.total_span, kTwoPi);
  EXPECT_NEAR(length(arcs.center), 0, 1e-15);
  EXPECT_NEAR(length(arcs.e1 - Vec3{4, 0, 0}), 0, 1e-14);
  EXPECT_NEAR(length(arcs.e2 - Vec3{0, 4, 0}), 0, 1e-14);
  // A right angle at the foot keeps a quarter, which enters through the leg along +x.
  ASSERT_TRUE(clip_ellipse(Ellipsoid({0, 0, 3}, {0, 0, 3}, 10), {0, 0, 0}, {20, 0, 0}, {0, 20, 0}, arcs));
  EXPECT_EQ(arcs.count, 1);
  EXPECT_NEAR(arcs.start(0), 0, 1e-15);
  EXPECT_NEAR(arcs.total_span, kPi / 2, 1e-15);
}

TEST(ClipEllipse, ThreeArcsInEdgeOrder) {
  // The circle of radius 1.1 leaves each side of an equilateral triangle of inradius 1 and comes back.
  const double r = 1.1, s = std::sqrt(3.0);
  EllipseArcs arcs;
  ASSERT_TRUE(clip_ellipse(Ellipsoid({0, 0, 0}, {0, 0, 0}, 2 * r), {-s, -1, 0}, {s, -1, 0}, {0, 2, 0}, arcs));
  ASSERT_EQ(arcs.count, 3);
  const double half_gap = std::acos(1 / r);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(arcs.span[i], kTwoPi / 3 - 2 * half_gap, 1e-14);
    const double expected = -kPi / 2 + half_gap + i * kTwoPi / 3;
    EXPECT_NEAR(std::remainder(arcs.start(i) - expected, kTwoPi), 0, 1e-14);
  }
}

TEST(ClipEllipse, FociInThePlaneOfTheTriangle) {
  // The plane contains the axis: the section is the generating ellipse.
  const Ellipsoid e({-3, 0, 0}, {3, 0, 0}, 10);
  EllipseArcs arcs;
  ASSERT_TRUE(clip_ellipse(e, {-40, -30, 0}, {40, -30, 0}, {0, 60, 0}, arcs));
  EXPECT_NEAR(length(arcs.e1 - Vec3{5, 0, 0}), 0, 1e-14);
  EXPECT_NEAR(length(arcs.e2 - Vec3{0, 4, 0}), 0, 1e-14);
  // Seen edge-on by the foci at one side: half the ellipse remains.
  ASSERT_TRUE(clip_ellipse(e, {0, -30, 0}, {40, 0, 0}, {0, 30, 0}, arcs));
  EXPECT_NEAR(arcs.total_span, kPi, 1e-14);
}

TEST(ClipEllipse, ThinEllipsoid) {
  // tau one part in 1e12 above the focal distance; a triangle across the axis sees a tiny, accurate circle.
  const double tau = 2 * (1 + 1e-12);
  const Ellipsoid e({0, 0, -1}, {0, 0, 1}, tau);
  const long double minor = std::sqrt((static_cast<long double>(tau) - 2) * (static_cast<long double>(tau) + 2)) / 2;
  EllipseArcs arcs;
  ASSERT_TRUE(clip_ellipse(e, {-1, -1, 0}, {2, -1, 0}, {0, 2, 0}, arcs));
  EXPECT_EQ(arcs.total_span, kTwoPi);
  EXPECT_NEAR(length(arcs.e1) / static_cast<double>(minor), 1, 1e-14);
  EXPECT_NEAR(length(arcs.e2) / static_cast<double>(minor), 1, 1e-14);
  EXPECT_NEAR(length(arcs.center), 0, 1e-18);
}

TEST(ClipEllipse, RefusesWhatHasNoArc) {
  EllipseArcs arcs;
  const Ellipsoid e({0, 0, 1}, {1, 0, 1}, 4);
  const Vec3 v0{-5, -5, 0}, v1{5, -5, 0}, v2{0, 5, 0};
  ASSERT_TRUE(clip_ellipse(e, v0, v1, v2, arcs));
  EXPECT_FALSE(clip_ellipse(e, v0, v1, v0, arcs));
  EXPECT_FALSE(clip_ellipse(e, v0, v0, v0, arcs));
  EXPECT_FALSE(clip_ellipse(e, v0, v0 + (v1 - v0) * 0.3, v1, arcs));
  EXPECT_FALSE(clip_ellipse(e, {-1.1, 0.3, 0.7}, {0.1, 0.9, 1.3}, {-0.5, 0.6, 1.0}, arcs));  // on a line, nearly
  EXPECT_FALSE(clip_ellipse(Ellipsoid({0, 0, 1}, {1, 0, 1}, 1), v0, v1, v2, arcs));
  EXPECT_FALSE(clip_ellipse(Ellipsoid({0, 0, 1}, {1, 0, 1}, 2), v0, v1, v2, arcs));  // specular length sqrt(5)
  EXPECT_FALSE(clip_ellipse(e, v0 * 0.01, v1 * 0.01, v2 * 0.01, arcs));              // wholly inside
  EXPECT_FALSE(clip_ellipse(e, v0 + Vec3{9, 0, 0}, v1 + Vec3{9, 0, 0}, v2 + Vec3{9, 0, 0}, arcs));
  EXPECT_EQ(arcs.count, 0);
  EXPECT_EQ(arcs.total_span, 0);
  const double inf = std::numeric_limits<double>::infinity();
  for (const double bad : {inf, -inf, std::nan("")})
    for (int i = 0; i < 9; ++i) {
      Vec3 v[3] = {v0, v1, v2};
      v[i / 3][i % 3] = bad;
      EXPECT_FALSE(clip_ellipse(e, v[0], v[1], v[2], arcs)) << bad << " in " << i;
      Vec3 f[3] = {e.a, e.b, {}};
      f[i / 3][i % 3] = bad;
      if (i < 6) {
        EXPECT_FALSE(clip_ellipse(Ellipsoid(f[0], f[1], 4), v0, v1, v2, arcs));
      }
    }
}

}  // namespace
}  // namespace isochron
