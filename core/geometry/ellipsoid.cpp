#include "core/geometry/ellipsoid.h"

#include <limits>

#include "core/base/constants.h"
#include "core/base/fast_angle.h"

namespace isochron {
namespace {

struct Vec2 {
  double x, y;
};
double dot(const Vec2& a, const Vec2& b) {
  return a.x * b.x + a.y * b.y;
}
double cross(const Vec2& a, const Vec2& b) {
  return a.x * b.y - a.y * b.x;
}

/// Counter-clockwise angle from a to b, in (-pi, pi].
double angle_between(const Vec2& a, const Vec2& b) {
  return fast_angle(cross(a, b), dot(a, b));
}

/// One edge of the triangle against the circle about the origin. Where the edge leaves the disc the circle
/// enters the triangle, and the other way round. Crossing points are scaled by the edge's squared length:
/// only angles matter.
struct EdgeCrossing {
  double height = 0;  ///< of the centre over the edge, inward, times the edge's length
  double half = 0;    ///< half the chord, times the edge's length
  Vec2 direction{};
  bool arc_starts = false, arc_ends = false;

  Vec2 outward() const { return {direction.y, -direction.x}; }
  Vec2 start_point() const {
    return {height * direction.y + half * direction.x, -height * direction.x + half * direction.y};
  }
  Vec2 end_point() const {
    return {height * direction.y - half * direction.x, -height * direction.x - half * direction.y};
  }
};

/// Angle of the arc that starts on edges[i]. Outside the disc the triangle's boundary runs on from there to
/// the next point where an arc ends: that point ends this arc too, because triangle and disc are convex.
double arc_span(const EdgeCrossing (&edges)[3], int i) {
  const EdgeCrossing& next = edges[(i + 1) % 3];
  const EdgeCrossing& last = edges[(i + 2) % 3];
  if (!next.arc_ends && !last.arc_ends) return 2 * fast_angle(edges[i].half, -edges[i].height);
  const Vec2 start = edges[i].start_point();
  const Vec2 end = next.arc_ends ? next.end_point() : last.end_point();
  const double span = angle_between(start, end);
  if (span >= 0) return span;
  // More than half a turn, or a tiny arc turned negative by round-off. Measured by way of the next edge's
  // normal both parts are less than half a turn, so their sum needs no wrapping and tells the two cases
  // apart.
  const Vec2 normal = next.outward();
  return angle_between(start, normal) + angle_between(normal, end);
}

}  // namespace

Foci::Foci(const Vec3& focus_a, const Vec3& focus_b)
    : a(focus_a), b(focus_b), center((focus_a + focus_b) * 0.5), axis{0, 0, 1} {
  const Vec3 d = b - a;
  distance = length(d);
  if (distance > 0 && std::isfinite(distance)) axis = d / distance;
  complete_frame(axis, side, up);
}

Ellipsoid::Ellipsoid(const Foci& foci, double total_length) : Foci(foci), tau(total_length) {
  if (!(tau > distance) || !std::isfinite(tau)) return;
  major = 0.5 * tau;
  // The product keeps the error equivalent to one round-off of tau, however thin the ellipsoid.
  minor = 0.5 * std::sqrt((tau - distance) * (tau + distance));
  inverse_major = 1 / major;
  inverse_minor = 1 / minor;
}

Vec3 EllipseArcs::point_at(double u) const {
  double rest = u * total_span;
  int i = 0;
  while (i + 1 < count && rest >= span[i]) rest -= span[i++];
  const auto [c, s] = fast_cos_sin(rest);
  const double scale = 1 / std::sqrt(start_cos[i] * start_cos[i] + start_sin[i] * start_sin[i]);
  return point((start_cos[i] * c - start_sin[i] * s) * scale, (start_sin[i] * c + start_cos[i] * s) * scale);
}

FocalTriangle::FocalTriangle(const Foci& foci, const Vec3& v0, const Vec3 (&edges)[2])
    : corner(foci.to_frame(v0 - foci.center)),
      edge{foci.to_frame(edges[0]), foci.to_frame(edges[1])},
      normal(cross(edge[0], edge[1])),
      first_edge(edges[0]) {
  // In a sliver the cross product is not quite perpendicular to its factors; clipping needs it perpendicular to the first.
  const double edge1_squared = length_squared(edge[0]);
  normal -= edge[0] * (dot(normal, edge[0]) / edge1_squared);
  constexpr double kRoundOff = 4 * std::numeric_limits<double>::epsilon();
  has_area = length_squared(normal) > kRoundOff * kRoundOff * edge1_squared * length_squared(edge[1]);
  const Vec3 to_a{corner.x + 0.5 * foci.distance, corner.y, corner.z};
  const Vec3 to_b{corner.x - 0.5 * foci.distance, corner.y, corner.z};
  height_a = dot(normal, to_a);
  height_b = dot(normal, to_b);
}

bool clip_ellipse(const Ellipsoid& ellipsoid, const FocalTriangle& triangle, EllipseArcs& arcs) {
  arcs.count = 0;
  arcs.total_span = 0;
  if (!ellipsoid.valid() || !triangle.has_area) return false;
  const double major = ellipsoid.major, minor = ellipsoid.minor;
  const Vec3& normal = triangle.normal;

  // The ellipsoid reaches the plane if minor^2 exceeds the product of the foci's heights over it, that is if tau exceeds the
  // length of the reflected (or, with the foci on different sides, the straight) path between them.
  const double excess = minor * minor * length_squared(normal) - triangle.height_a * triangle.height_b;
  if (!(excess > 0)) return false;
  const double offset = 0.5 * (triangle.height_a + triangle.height_b);
  const double support_squared = excess + offset * offset;
  if (!(support_squared < std::numeric_limits<double>::infinity())) return false;

  // To the space where the ellipsoid is the unit sphere: in the foci's frame the map is diagonal.
  const double inverse_major = ellipsoid.inverse_major, inverse_minor = ellipsoid.inverse_minor;
  const auto map = [&](const Vec3& v) { return Vec3{v.x * inverse_major, v.y * inverse_minor, v.z * inverse_minor}; };
  const auto unmap = [&](const Vec3& w) { return ellipsoid.from_frame({major * w.x, minor * w.y, minor * w.z}); };
  const Vec3 w0 = map(triangle.corner), d1 = map(triangle.edge[0]), d2 = map(triangle.edge[1]);
  const bool inside[3] = {length_squared(w0) < 1, length_squared(w0 + d1) < 1, length_squared(w0 + d2) < 1};
  if (inside[0] && inside[1] && inside[2]) return false;

  // The circle: centre on the mapped normal (whose length is the support) at signed distance offset / support. In-plane axes
  // are along and across the first edge, and coordinates in units of one over its length, so that neither has to be made a
  // unit vector. The circle lies beyond the first edge's line where the origin's height over it exceeds the radius; squared,
  // that takes no root.
  const Vec3 mapped_normal{major * normal.x, minor * normal.y, minor * normal.z};
  const Vec3 across = cross(mapped_normal, d1);
  const double base_squared = length_squared(d1), height = dot(w0, across);
  if (height > 0 && height * height >= excess * base_squared) return false;
  const double inverse = 1 / (support_squared * base_squared);
  const double per_base = std::sqrt(excess * inverse);  // radius / length of the first edge
  const double support = std::sqrt(support_squared), inverse_support = support * inverse * base_squared;
  const double radius_squared = excess * inverse * (base_squared * base_squared);
  const Vec2 p0{dot(w0, d1), height * inverse_support};
  // The third vertex' height from the triangle's area: a dot product would lose the digits of a sliver.
  const Vec2 to_third{dot(d2, d1), support * inverse_major * inverse_minor * inverse_minor};
  const Vec2 vertices[3] = {p0, {p0.x + base_squared, p0.y}, {p0.x + to_third.x, p0.y + to_third.y}};
  const Vec2 directions[3] = {{base_squared, 0}, {to_third.x - base_squared, to_third.y}, {-to_third.x, -to_third.y}};

  EdgeCrossing edges[3];
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3;
    EdgeCrossing& edge = edges[i];
    edge.direction = directions[i];
    edge.height = cross(vertices[i], directions[i]);
    const double half_squared = radius_squared * dot(directions[i], directions[i]) - edge.height * edge.height;
    if (half_squared <= 0 && edge.height < 0) return false;
    // Both edges at a vertex read the same inside flag, so starts and ends of arcs alternate whatever the
    // round-off.
    const bool dips_in = !inside[i] && !inside[j] && half_squared > 0 && dot(vertices[i], directions[i]) < 0 &&
                         dot(vertices[j], directions[i]) > 0;
    edge.arc_starts = !inside[j] && (inside[i] || dips_in);
    edge.arc_ends = !inside[i] && (inside[j] || dips_in);
    if (edge.arc_starts || edge.arc_ends) edge.half = std::sqrt(std::max(half_squared, 0.0));
  }

  for (int i = 0; i < 3; ++i) {
    if (!edges[i].arc_starts) continue;
    const double span = arc_span(edges, i);
    if (!(span > 0)) continue;
    const Vec2 start = edges[i].start_point();
    arcs.start_cos[arcs.count] = start.x;
    arcs.start_sin[arcs.count] = start.y;
    arcs.span[arcs.count++] = span;
    arcs.total_span += span;
  }
  if (arcs.count == 0) {
    const bool crossed = edges[0].arc_starts || edges[1].arc_starts || edges[2].arc_starts;
    const bool centre_inside = edges[0].height > 0 && edges[1].height > 0 && edges[2].height > 0;
    if (crossed || !centre_inside) return false;
    arcs.count = 1;
    arcs.start_cos[0] = 1;
    arcs.start_sin[0] = 0;
    arcs.span[0] = arcs.total_span = kTwoPi;
  }
  arcs.center = ellipsoid.center + unmap(mapped_normal * (offset * inverse_support * inverse_support));
  arcs.e1 = triangle.first_edge * per_base;
  arcs.e2 = unmap(across * (per_base * inverse_support));
  return true;
}

double area_per_angle_and_length(const Ellipsoid& ellipsoid, const Vec3& q, const Vec3& n) {
  return area_per_angle_and_length(ellipsoid, length(q - ellipsoid.a), length(q - ellipsoid.b), n);
}

double area_per_angle_and_length(const Ellipsoid& ellipsoid, double distance_a, double distance_b, const Vec3& n) {
  // With p = q - centre, the surface is Q(p) = p.Kp = 1 and u_a + u_b = 2 major minor^2 Kp / (|q-a| |q-b|).
  // The arcs' centre is K-conjugate to the plane, so only the part v = e1 cos + e2 sin of p has an in-plane
  // gradient; it is conjugate to w = dq/dphi, and v.Kv = r^2 with r the circle's radius gives |P_T Kv| = r^2
  // |w| / |e1 x e2|. Finally |e1 x e2| = r^2 major minor^2 / sqrt(minor^2 + (n.(b-a)/2)^2): the shrinking
  // radius drops out of the ratio.
  const double across = dot(n, ellipsoid.b - ellipsoid.a);
  return distance_a * distance_b / std::sqrt(4 * ellipsoid.minor * ellipsoid.minor + across * across);
}

}  // namespace isochron
