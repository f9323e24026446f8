#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "core/base/constants.h"
#include "core/geometry/ellipsoid.h"
#include "tests/geometry/random_cases.h"

namespace isochron {
namespace {

TEST(AreaPerAngleAndLength, MatchesItsDefinition) {
  RandomCases random;
  int checked = 0;
  for (int k = 0; k < 20000; ++k) {
    const Triangle t = random.triangle();
    const Ellipsoid e = random.ellipsoid(t);
    EllipseArcs arcs;
    if (!clip_ellipse(e, t.v0, t.v1, t.v2, arcs)) continue;
    const double phi = arcs.start(0) + 0.4 * arcs.span[0];
    const Vec3 n = t.normal(), q = arcs.point(phi);
    const Vec3 dq = arcs.e2 * std::cos(phi) - arcs.e1 * std::sin(phi);
    const Vec3 gradient = normalize(q - e.a) + normalize(q - e.b);
    const double in_plane = length(gradient - n * dot(n, gradient));
    // The literal quotient is a good reference only away from the specular point and from slivers.
    if (in_plane < 1e-2 || t.area() < 0.02 * length_squared(t.v1 - t.v0)) continue;
    ++checked;
    const double expected = length(dq) / in_plane;
    EXPECT_NEAR(area_per_angle_and_length(e, q, n), expected, 1e-9 * expected) << "case " << k;
  }
  EXPECT_GT(checked, 5000);
}

TEST(AreaPerAngleAndLength, AccurateAsTheEllipseShrinks) {
  // Foci at height h over the plane, 2f apart: the section has semi-axes A sqrt(1 - (h/B)^2) and sqrt(B^2 -
  // h^2), so its area grows with tau = 2A at pi/2 [B - h^2/B + A^2/B (1 + h^2/B^2)], which is finite at B =
  // h.
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
      sum += area_per_angle_and_length(e, arcs.point(kTwoPi * (i + 0.5) / steps), {0, 0, 1}) * kTwoPi / steps;
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
      // The arcs change their topology at the lengths of the vertices, at the least length of every edge and
      // of the plane; in between the integrand is smooth but for square roots at the ends, which the cosine
      // map removes.
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
                      area_per_angle_and_length(e, arcs.point(arcs.start(k) + arcs.span[k] * m / inner), n);
            }
        }
      EXPECT_NEAR(area / t.area(), 1, 1e-6);
    }
}

}  // namespace
}  // namespace isochron
