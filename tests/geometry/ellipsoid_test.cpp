#include "core/geometry/ellipsoid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "core/math/constants.h"

namespace isochron {
namespace {

using Vec3L = Vec3T<long double>;

struct Triangle {
  Vec3 v0, v1, v2;
  double area() const { return 0.5 * length(cross(v1 - v0, v2 - v0)); }
  Vec3 normal() const { return normalize(cross(v1 - v0, v2 - v0)); }
};

Vec3L extended(const Vec3& v) { return {v.x, v.y, v.z}; }

/// Total span in long double by another route: in-plane axes from a Gram-Schmidt under the quadratic form, all roots
/// of the three edge functions sorted, and the midpoint of every piece tested. `margin` is the least relative distance
/// from a change of topology.
long double reference_span(const Ellipsoid& e, const Triangle& t, long double& margin) {
  margin = 1;
  const Vec3L a = extended(e.a), b = extended(e.b), c = (a + b) / 2.0L, f = (b - a) / 2.0L;
  const long double tau = e.tau;
  const long double minor2 = (tau * tau - 4 * length_squared(f)) / 4, major2 = tau * tau / 4;
  const Vec3L v[3] = {extended(t.v0), extended(t.v1), extended(t.v2)};
  const Vec3L n = cross(v[1] - v[0], v[2] - v[0]);
  // Inverse of the shape matrix minor2 I + f f^T (Sherman-Morrison); the ellipsoid is x.Kx = 1.
  const auto K = [&](const Vec3L& x) { return (x - f * (dot(f, x) / major2)) / minor2; };
  const Vec3L sn = n * minor2 + f * dot(f, n);
  const long double h2 = dot(n, sn), d = dot(n, v[0] - c);
  const long double r2 = 1 - d * d / h2;
  margin = std::min(margin, std::abs(r2));
  if (r2 <= 0) return 0;
  const Vec3L centre = c + sn * (d / h2);
  Vec3L e1 = v[2] - v[0];
  e1 *= std::sqrt(r2 / dot(e1, K(e1)));
  Vec3L e2 = v[1] - v[0];
  e2 -= e1 * (dot(e1, K(e2)) / r2);
  e2 *= std::sqrt(r2 / dot(e2, K(e2)));
  std::vector<long double> roots;
  long double C[3], X[3], Y[3];
  for (int i = 0; i < 3; ++i) {
    const Vec3L inward = cross(n, v[(i + 1) % 3] - v[i]);
    C[i] = dot(inward, centre - v[i]), X[i] = dot(inward, e1), Y[i] = dot(inward, e2);
    const long double R = std::hypot(X[i], Y[i]), phase = std::atan2(Y[i], X[i]);
    margin = std::min(margin, std::abs(std::abs(C[i]) / R - 1));
    if (std::abs(C[i]) >= R) continue;
    const long double w = std::acos(-C[i] / R);
    roots.push_back(phase - w), roots.push_back(phase + w);
  }
  const auto inside = [&](long double phi) {
    for (int i = 0; i < 3; ++i)
      if (C[i] + X[i] * std::cos(phi) + Y[i] * std::sin(phi) < 0) return false;
    return true;
  };
  const long double two_pi = 2 * std::acos(-1.0L);
  if (roots.empty()) return inside(0) ? two_pi : 0;
  for (long double& r : roots) r -= two_pi * std::floor(r / two_pi);
  std::sort(roots.begin(), roots.end());
  roots.push_back(roots[0] + two_pi);
  long double sum = 0;
  for (std::size_t i = 0; i + 1 < roots.size(); ++i) {
    const long double piece = roots[i + 1] - roots[i];
    if (i + 2 < roots.size()) margin = std::min(margin, piece);
    if (inside((roots[i] + roots[i + 1]) / 2)) sum += piece;
  }
  return sum;
}

double sum_of_distances(const Ellipsoid& e, const Vec3& q) { return length(q - e.a) + length(q - e.b); }

class RandomCases {
 public:
  Vec3 vec(double scale) { return {scale * normal_(rng_), scale * normal_(rng_), scale * normal_(rng_)}; }
  double uniform() { return uniform_(rng_); }
  Triangle triangle() {
    // A common centre, sizes over two decades, one vertex in eight pulled on the opposite edge: a sliver.
    const double size = std::pow(10.0, 2 * uniform() - 1);
    const Vec3 centre = vec(0.5);
    Triangle t{centre + vec(size), centre + vec(size), centre + vec(size)};
    if (uniform() < 0.125) t.v2 = t.v0 + (t.v1 - t.v0) * uniform() + (t.v2 - t.v0) * 1e-3;
    return t;
  }
  /// Half of them pass through a point of the triangle, so that the two meet.
  Ellipsoid ellipsoid(const Triangle& t) {
    const Vec3 a = vec(1);
    const double kind = uniform();
    const Vec3 b = kind < 0.1 ? a : vec(1);
    double tau = length(b - a) * (1 + std::pow(10.0, 4 * uniform() - 4)) + 1e-3 * uniform();
    if (uniform() < 0.75) {
      const double x = uniform(), y = uniform() * (1 - x);
      const Vec3 q = t.v0 + (t.v1 - t.v0) * x + (t.v2 - t.v0) * y;
      tau = length(q - a) + length(q - b);
    }
    return Ellipsoid(a, b, tau);
  }

 private:
  std::mt19937_64 rng_{20240611};
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

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
    long double margin;
    const long double expected = reference_span(e, t, margin);
    EllipseArcs arcs;
    const bool hit = clip_ellipse(e, t.v0, t.v1, t.v2, arcs);
    EXPECT_EQ(hit, arcs.count > 0);
    if (margin < 1e-9L) {
      ++close_calls;  // roots that nearly coincide: the span itself is ill-conditioned
      continue;
    }
    // Positions are good to round-off of the coordinates; in angle they are divided by the size of the ellipse and, at
    // grazing roots, by the square root of the margin.
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
      const Vec3 q = arcs.point(arcs.angle(u));
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
      const int edge = nearest_edge(arcs.start[i]);
      if (sine > 0.05) {
        EXPECT_GT(edge, previous) << "arcs out of order in case " << k;
      }
      previous = edge;
      nearest_edge(arcs.start[i] + arcs.span[i]);
    }
  }
}

TEST(ClipEllipse, NearbyInputsGiveNearbyPoints) {
  // Equal random numbers on slightly different inputs. Where arcs appear, merge or shrink to nothing no order can be
  // continuous, and where an edge is grazed the ends move like the square root of the step: at steps of 1e-9 those
  // are a few in a thousand.
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
        distance = std::max(distance, length(arcs.point(arcs.angle(u)) - other[i].point(other[i].angle(u))));
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
  EXPECT_EQ(arcs.start[0], 0);
  EXPECT_EQ(arcs.total_span, kTwoPi);
  EXPECT_NEAR(length(arcs.center), 0, 1e-15);
  EXPECT_NEAR(length(arcs.e1 - Vec3{4, 0, 0}), 0, 1e-14);
  EXPECT_NEAR(length(arcs.e2 - Vec3{0, 4, 0}), 0, 1e-14);
  // A right angle at the foot keeps a quarter, which enters through the leg along +x.
  ASSERT_TRUE(clip_ellipse(Ellipsoid({0, 0, 3}, {0, 0, 3}, 10), {0, 0, 0}, {20, 0, 0}, {0, 20, 0}, arcs));
  EXPECT_EQ(arcs.count, 1);
  EXPECT_NEAR(arcs.start[0], 0, 1e-15);
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
    EXPECT_NEAR(std::remainder(arcs.start[i] - expected, kTwoPi), 0, 1e-14);
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

TEST(AreaPerAngleAndLength, MatchesItsDefinition) {
  RandomCases random;
  int checked = 0;
  for (int k = 0; k < 20000; ++k) {
    const Triangle t = random.triangle();
    const Ellipsoid e = random.ellipsoid(t);
    EllipseArcs arcs;
    if (!clip_ellipse(e, t.v0, t.v1, t.v2, arcs)) continue;
    const double phi = arcs.angle(0.4);
    const Vec3 n = t.normal(), q = arcs.point(phi);
    const Vec3 dq = arcs.e2 * std::cos(phi) - arcs.e1 * std::sin(phi);
    const Vec3 gradient = normalize(q - e.a) + normalize(q - e.b);
    const double in_plane = length(gradient - n * dot(n, gradient));
    // The literal quotient is a good reference only away from the specular point and from slivers.
    if (in_plane < 1e-2 || t.area() < 0.02 * length_squared(t.v1 - t.v0)) continue;
    ++checked;
    const double expected = length(dq) / in_plane;
    EXPECT_NEAR(area_per_angle_and_length(e, arcs, phi, n), expected, 1e-9 * expected) << "case " << k;
  }
  EXPECT_GT(checked, 5000);
}

TEST(AreaPerAngleAndLength, AccurateAsTheEllipseShrinks) {
  // Foci at height h over the plane, 2f apart: the section has semi-axes A sqrt(1 - (h/B)^2) and sqrt(B^2 - h^2), so
  // its area grows with tau = 2A at pi/2 [B - h^2/B + A^2/B (1 + h^2/B^2)], which is finite at B = h.
  const double h = 0.7, f = 1.3;
  const double specular = 2 * std::hypot(h, f);
  for (const double above : {1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 1.0}) {
    const double tau = specular * (1 + above);
    const Ellipsoid e({-f, 0, h}, {f, 0, h}, tau);
    EllipseArcs arcs;
    if (!clip_ellipse(e, {-30, -20, 0}, {30, -20, 0}, {0, 40, 0}, arcs)) {
      EXPECT_LE(above, 1e-15);
      continue;
    }
    const int steps = 64;
    double sum = 0;
    for (int i = 0; i < steps; ++i)
      sum += area_per_angle_and_length(e, arcs, kTwoPi * (i + 0.5) / steps, {0, 0, 1}) * kTwoPi / steps;
    const long double A = tau / 2.0L, B2 = A * A - static_cast<long double>(f) * f, B = std::sqrt(B2);
    const long double h2 = static_cast<long double>(h) * h;
    const double rate = static_cast<double>(std::acos(-1.0L) / 2 * (B - h2 / B + A * A / B * (1 + h2 / B2)));
    EXPECT_NEAR(sum / rate, 1, 1e-13) << above;
  }
}

TEST(AreaPerAngleAndLength, SweepsTheTriangleOnce) {
  const Triangle triangles[] = {{{0, 0, 0}, {2, 0.3, 0.1}, {0.5, 1.5, -0.4}},
                                {{-3, -2, 0}, {3, -2, 0}, {0, 4, 0}},
                                {{0.2, 0.1, 0.5}, {2.2, 0.15, 0.6}, {1.0, 0.2, 0.5}}};
  const std::pair<Vec3, Vec3> foci[] = {
      {{0.3, 0.2, 1.5}, {1.0, -0.4, 0.8}}, {{0.1, 0.2, 1}, {0.1, 0.2, 1}}, {{0.5, 0.5, 0}, {-0.5, 0.3, -2}}};
  const auto segment_minimum = [](const std::function<double(double)>& s) {
    double lo = 0, hi = 1;
    for (int i = 0; i < 200; ++i) {
      const double x = lo + (hi - lo) / 3, y = hi - (hi - lo) / 3;
      (s(x) < s(y) ? hi : lo) = s(x) < s(y) ? y : x;
    }
    return s(lo);
  };
  for (const Triangle& t : triangles)
    for (const auto& [a, b] : foci) {
      // The arcs change their topology at the lengths of the vertices, at the least length of every edge and of the
      // plane; in between the integrand is smooth but for square roots at the ends, which the cosine map removes.
      const auto s = [a = a, b = b](const Vec3& q) { return length(q - a) + length(q - b); };
      const Vec3 v[3] = {t.v0, t.v1, t.v2}, n = t.normal();
      std::vector<double> breaks;
      for (int i = 0; i < 3; ++i) {
        breaks.push_back(s(v[i]));
        breaks.push_back(segment_minimum([&](double x) { return s(v[i] + (v[(i + 1) % 3] - v[i]) * x); }));
      }
      breaks.push_back(std::sqrt(length_squared(b - a) + std::max(0.0, 4 * dot(n, a - t.v0) * dot(n, b - t.v0))));
      std::sort(breaks.begin(), breaks.end());
      double area = 0;
      const int outer = 200, inner = 64;
      for (std::size_t i = 0; i + 1 < breaks.size(); ++i)
        for (int j = 1; j < outer; ++j) {  // Simpson's rule twice; the outer one's end points have no weight
          const double theta = kPi * j / outer, half = (breaks[i + 1] - breaks[i]) / 2;
          const Ellipsoid e(a, b, breaks[i] + half * (1 - std::cos(theta)));
          EllipseArcs arcs;
          if (!clip_ellipse(e, t.v0, t.v1, t.v2, arcs)) continue;
          for (int k = 0; k < arcs.count; ++k)
            for (int m = 0; m <= inner; ++m) {
              const double weight = (m == 0 || m == inner ? 1 : m % 2 ? 4 : 2) / (3.0 * inner);
              area += weight * arcs.span[k] * half * std::sin(theta) * kPi / outer * (j % 2 ? 4 : 2) / 3 *
                      area_per_angle_and_length(e, arcs, arcs.start[k] + arcs.span[k] * m / inner, n);
            }
        }
      EXPECT_NEAR(area / t.area(), 1, 1e-6);
    }
}

}  // namespace
}  // namespace isochron
