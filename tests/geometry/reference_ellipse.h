// The ellipse that an ellipsoid cuts out of a triangle's plane, in long double and by another route than the
// code's.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "tests/geometry/random_cases.h"

namespace isochron {

using Vec3L = Vec3T<long double>;

inline Vec3L extended(const Vec3& v) {
  return {v.x, v.y, v.z};
}

/// In-plane axes from a Gram-Schmidt under the quadratic form, all roots of the three edge functions sorted,
/// and the midpoint of every piece tested.
struct ReferenceEllipse {
  Vec3L center, e1, e2;    ///< q(phi) = center + e1 cos phi + e2 sin phi, frame as EllipseArcs has it
  long double span = 0;    ///< radians inside the triangle
  long double margin = 1;  ///< least relative distance from a change of topology
  bool meets_plane = false;

  ReferenceEllipse(const Ellipsoid& e, const Triangle& t)
      : ReferenceEllipse(extended(e.a), extended(e.b), e.tau, {extended(t.v0), extended(t.v1), extended(t.v2)}) {}

  ReferenceEllipse(const Vec3L& a, const Vec3L& b, long double tau, const Vec3L (&v)[3]) {
    const Vec3L c = (a + b) / 2.0L, f = (b - a) / 2.0L;
    const long double focal = length(f);
    const long double minor2 = (tau - 2 * focal) * (tau + 2 * focal) / 4, major2 = tau * tau / 4;
    const Vec3L n = cross(v[1] - v[0], v[2] - v[0]);
    // Inverse of the shape matrix minor2 I + f f^T (Sherman-Morrison); the ellipsoid is x.Kx = 1.
    const auto K = [&](const Vec3L& x) { return (x - f * (dot(f, x) / major2)) / minor2; };
    const Vec3L sn = n * minor2 + f * dot(f, n);
    const long double h2 = dot(n, sn), d = dot(n, v[0] - c);
    const long double r2 = 1 - d * d / h2;
    margin = std::min(margin, std::abs(r2));
    if (!(minor2 > 0) || !(r2 > 0)) return;
    meets_plane = true;
    center = c + sn * (d / h2);
    e1 = v[1] - v[0];
    e1 *= std::sqrt(r2 / dot(e1, K(e1)));
    e2 = v[2] - v[0];
    e2 -= e1 * (dot(e1, K(e2)) / r2);
    e2 *= std::sqrt(r2 / dot(e2, K(e2)));
    std::vector<long double> roots;
    long double C[3], X[3], Y[3];
    for (int i = 0; i < 3; ++i) {
      const Vec3L inward = cross(n, v[(i + 1) % 3] - v[i]);
      C[i] = dot(inward, center - v[i]), X[i] = dot(inward, e1), Y[i] = dot(inward, e2);
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
    if (roots.empty()) {
      span = inside(0) ? two_pi : 0;
      return;
    }
    for (long double& r : roots) r -= two_pi * std::floor(r / two_pi);
    std::sort(roots.begin(), roots.end());
    roots.push_back(roots[0] + two_pi);
    for (std::size_t i = 0; i + 1 < roots.size(); ++i) {
      const long double piece = roots[i + 1] - roots[i];
      if (i + 2 < roots.size()) margin = std::min(margin, piece);
      if (inside((roots[i] + roots[i + 1]) / 2)) span += piece;
    }
  }

  Vec3L point(long double phi) const { return center + e1 * std::cos(phi) + e2 * std::sin(phi); }
  /// dA / (dphi dtau) at q(phi), the literal quotient |dq/dphi| / |P_T (u_a + u_b)|.
  long double area_rate(const Vec3L& a, const Vec3L& b, long double phi) const {
    const Vec3L q = point(phi), dq = e2 * std::cos(phi) - e1 * std::sin(phi), n = normalize(cross(e1, e2));
    const Vec3L gradient = normalize(q - a) + normalize(q - b);
    return length(dq) / length(gradient - n * dot(n, gradient));
  }
};

}  // namespace isochron
