// Points with |q-a| + |q-b| = tau on triangles: the ellipsoidal change of variable (theory section 4, paper
// Eqs. 6-8).
#pragma once
#include "core/base/vec.h"

namespace isochron {

/// What ellipsoids of revolution with foci a and b (they may coincide: spheres) have in common.
struct Foci {
  Vec3 a, b;
  double distance = 0;
  Vec3 center, axis;  ///< unit axis; any unit vector when the foci coincide
  Vec3 side, up;      ///< complete the axis to an orthonormal frame

  Foci(const Vec3& focus_a, const Vec3& focus_b);
  /// Components of a vector along axis, side and up, and the vector of such components.
  Vec3 to_frame(const Vec3& v) const { return {dot(axis, v), dot(side, v), dot(up, v)}; }
  Vec3 from_frame(const Vec3& w) const { return axis * w.x + side * w.y + up * w.z; }
};

/// Ellipsoid of revolution of total length tau >= |a-b|.
struct Ellipsoid : Foci {
  double tau = 0;
  double major = 0, minor = 0;  ///< semi-axes
  double inverse_major = 0, inverse_minor = 0;

  /// Empty (valid() false) when tau <= |a-b| or is not finite.
  Ellipsoid(const Foci& foci, double total_length);
  Ellipsoid(const Vec3& focus_a, const Vec3& focus_b, double total_length)
      : Ellipsoid(Foci(focus_a, focus_b), total_length) {}
  bool valid() const { return minor > 0; }
};

/// What the ellipsoids with the same foci share of a triangle (v0, v1, v2) that they are intersected with.
struct FocalTriangle {
  // In the foci's frame, about their centre.
  Vec3 corner;                ///< v0
  Vec3 edge[2];               ///< v1 and v2 from v0
  Vec3 normal;                ///< edge[0] x edge[1], perpendicular to edge[0] in slivers too
  Vec3 first_edge;            ///< edge[0] in the scene's frame
  double height_a, height_b;  ///< of the plane over the foci, times the normal's length
  bool has_area = false;

  FocalTriangle(const Foci& foci, const Vec3& v0, const Vec3& v1, const Vec3& v2)
      : FocalTriangle(foci, v0, {v1 - v0, v2 - v0}) {}
  FocalTriangle(const Foci& foci, const Vec3& v0, const Vec3 (&edges)[2]);
};

/// The part of an ellipse that lies inside a triangle: q(phi) = center + e1 cos phi + e2 sin phi over up to
/// three arcs. The frame (e1, e2) and the order of the arcs vary continuously with tau, foci and triangle, so
/// that equal random numbers on nearby ellipsoids give nearby points (coupled pairs rely on it): e1 points
/// along the edge v0 -> v1, angles grow from there around the triangle's normal (v1-v0) x (v2-v0), every arc
/// starts where it enters the triangle, and arcs are ordered by the edge they enter through. A complete
/// ellipse starts at phi = 0.
struct EllipseArcs {
  Vec3 center, e1, e2;
  int count = 0;
  double start_cos[3], start_sin[3];  ///< of the angles where arcs start, up to a common factor
  double span[3];
  double total_span = 0;  ///< radians; the density of a uniform pick is 1 / total_span per radian

  double start(int i) const { return std::atan2(start_sin[i], start_cos[i]); }
  Vec3 point(double phi) const { return point(std::cos(phi), std::sin(phi)); }
  /// The point at fraction u in (0, 1) of the total span.
  Vec3 point_at(double u) const;

 private:
  Vec3 point(double cosine, double sine) const { return center + e1 * cosine + e2 * sine; }
};

/// Intersects the ellipsoid with a triangle made for its foci. False when they do not meet in an arc of positive length, when
/// the triangle has no area, and when a coordinate is not finite.
bool clip_ellipse(const Ellipsoid& ellipsoid, const FocalTriangle& triangle, EllipseArcs& arcs);
inline bool clip_ellipse(const Ellipsoid& ellipsoid, const Vec3& v0, const Vec3& v1, const Vec3& v2,
                         EllipseArcs& arcs) {
  return clip_ellipse(ellipsoid, FocalTriangle(ellipsoid, v0, v1, v2), arcs);
}

/// dA / (dphi dtau) at the ellipse's point q: |dq/dphi| / |P_T (u_a + u_b)|, in length units, with n the triangle's unit
/// normal. Stays bounded where the ellipse shrinks to a point: it equals |q-a| |q-b| / sqrt(tau^2 - |P_T
/// (b-a)|^2).
double area_per_angle_and_length(const Ellipsoid& ellipsoid, const Vec3& q, const Vec3& n);
/// The same from the point's distances from the foci.
double area_per_angle_and_length(const Ellipsoid& ellipsoid, double distance_a, double distance_b, const Vec3& n);

}  // namespace isochron
