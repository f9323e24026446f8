// Shadows of edges, cast from a point of an emitter onto the plane of a triangle, and the lengths of the paths that graze them.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "core/base/quadratic.h"
#include "core/paths/prepared_scene.h"
#include "core/techniques/boundary_edges.h"

namespace isochron {

/// Where the line from S through an edge meets the plane: D = S + p / m(s), p = a + s c, with m(s) linear in the fraction s along the edge.
class CastShadow {
 public:
  CastShadow(const PreparedScene& scene, const SurfacePoint& lamp, const BoundaryEdge& edge, int receiver)
      : s_(lamp.p), a_(edge.origin - s_), c_(edge.end - edge.origin) {
    const double height = scene.height_over(receiver, s_);
    if (height == 0) high_ = low_;
    keep(dot(lamp.n, a_), dot(lamp.n, c_));
    m0_ = -dot(scene.normal(receiver), a_) / height;
    m1_ = -dot(scene.normal(receiver), c_) / height;
    // The edge lies between S and the plane, and the shadow inside of the triangle: S sees its sides on the same side of it.
    keep(m0_, m1_);
    keep(1 - m0_, -m1_);
    auto corners = scene.corners(receiver);
    for (Vec3& corner : corners) corner -= s_;
    const double facing = height > 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) {
      const Vec3 side = cross(corners[i], corners[(i + 1) % 3]) * facing;
      keep(dot(side, a_), dot(side, c_));
    }
  }

  /// The part of the edge whose shadow falls into the triangle, from 0 to 1.
  double part() const { return std::max(0.0, high_ - low_); }
  bool within(double s) const { return s > low_ && s < high_; }
  /// A point of this part, for u in (0, 1).
  double point(double u) const { return low_ + u * part(); }

  /// Where a path from S by D to the camera has length tau; the roots may be on the edge or not.
  std::optional<std::array<double, 2>> at_length(const Vec3& camera, double tau) const {
    const Vec3 eye = camera - s_;
    // |D - eye| = tau - |D| squared: 2 tau |p| = (tau^2 - |eye|^2) m + 2 p.eye
    const double k = tau * tau - length_squared(eye), r0 = k * m0_ + 2 * dot(a_, eye), r1 = k * m1_ + 2 * dot(c_, eye);
    const double t2 = 4 * tau * tau;
    auto roots = quadratic_roots(t2 * dot(c_, c_) - r1 * r1, t2 * dot(a_, c_) - r0 * r1, t2 * dot(a_, a_) - r0 * r0);
    if (!roots) return std::nullopt;
    // Squares have solutions of other signs, too.
    for (double& s : *roots)
      if (!(r0 + s * r1 > 0 && length(a_ + c_ * s) < tau * (m0_ + s * m1_))) s = -1;
    return roots;
  }
  /// |d length / ds|
  double length_rate(const Vec3& camera, double s) const {
    const Vec3 p = a_ + c_ * s, eye = camera - s_;
    const double m = m0_ + s * m1_;
    const Vec3 rate = (c_ - p * (m1_ / m)) / m;
    return std::abs(dot(normalize(p) + normalize(p / m - eye), rate));
  }

 private:
  /// Only where x0 + s x1 > 0.
  void keep(double x0, double x1) {
    const double zero = -x0 / x1;
    if (x1 > 0)
      low_ = std::max(low_, zero);
    else if (x1 < 0)
      high_ = std::min(high_, zero);
    else if (!(x0 > 0))
      high_ = low_;
  }

  Vec3 s_, a_, c_;
  double m0_ = 0, m1_ = 0, low_ = 0, high_ = 1;
};

}  // namespace isochron
