#include "core/geometry/ellipsoid.h"

#include <limits>

#include "core/base/constants.h"

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
  return std::atan2(cross(a, b), dot(a, b));
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
  if (!next.arc_ends && !last.arc_ends) return 2 * std::atan2(edges[i].half, -edges[i].height);
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
}

Vec3 EllipseArcs::point_at(double u) const {
  double rest = u * total_span;
  int i = 0;
  while (i + 1 < count && rest >= span[i]) rest -= span[i++];
  const double c = std::cos(rest), s = std::sin(rest);
  return point(start_cos[i] * c - start_sin[i] * s, start_sin[i] * c + start_cos[i] * s);
}

bool clip_ellipse(const Ellipsoid& ellipsoid, const Vec3& v0, const Vec3& v1, const Vec3& v2, EllipseArcs& arcs) {
  arcs.count = 0;
  arcs.total_span = 0;
  if (!ellipsoid.valid()) return false;
  const double major = ellipsoid.major, minor = ellipsoid.minor;

  // Normal, not normalised. In a sliver the cross product is not quite perpendicular to its factors; the
  // frame below needs it perpendicular to the first.
  const Vec3 edge1 = v1 - v0, edge2 = v2 - v0;
  const double edge1_squared = length_squared(edge1);
  Vec3 normal = cross(edge1, edge2);
  normal -= edge1 * (dot(normal, edge1) / edge1_squared);
  const double normal_squared = length_squared(normal);
  constexpr double kRoundOff = 4 * std::numeric_limits<double>::epsilon();
  if (!(normal_squared > kRoundOff * kRoundOff * edge1_squared * length_squared(edge2))) return false;

  // The ellipsoid reaches the plane if minor^2 exceeds the product of the foci's heights over it, that is if
  // tau exceeds the length of the reflected (or, with the foci on different sides, the straight) path between
  // them.
  const double height_a = dot(normal, v0 - ellipsoid.a), height_b = dot(normal, v0 - ellipsoid.b);
  const double excess = minor * minor * normal_squared - height_a * height_b;
  if (!(excess > 0)) return false;
  const double offset = 0.5 * (height_a + height_b);
  const double support_squared = excess + offset * offset;
  if (!(support_squared < std::numeric_limits<double>::infinity())) return false;

  // To the space where the ellipsoid is the unit sphere, in the ellipsoid's own frame so that the map is
  // diagonal.
  const double inverse_major = 1 / major, inverse_minor = 1 / minor;
  const auto map = [&](const Vec3& v) {
    return Vec3{dot(ellipsoid.axis, v) * inverse_major, dot(ellipsoid.side, v) * inverse_minor,
                dot(ellipsoid.up, v) * inverse_minor};
  };
  const auto unmap = [&](const Vec3& w) {
    return ellipsoid.axis * (major * w.x) + ellipsoid.side * (minor * w.y) + ellipsoid.up * (minor * w.z);
  };
  const Vec3 w0 = map(v0 - ellipsoid.center), d1 = map(edge1), d2 = map(edge2);
  const bool inside[3] = {length_squared(w0) < 1, length_squared(w0 + d1) < 1, length_squared(w0 + d2) < 1};
  if (inside[0] && inside[1] && inside[2]) return false;

  // The circle: centre on the mapped normal at signed distance offset / support, in-plane axes along and
  // across the first edge.
  const double radius_squared = excess / support_squared;
  const double radius = std::sqrt(radius_squared);
  const Vec3 mapped_normal{major * dot(ellipsoid.axis, normal), minor * dot(ellipsoid.side, normal),
                           minor * dot(ellipsoid.up, normal)};
  const double mapped_length = length(mapped_normal), edge1_length = length(d1);
  const Vec3 unit_normal = mapped_normal * (1 / mapped_length);
  const double inverse_length = 1 / edge1_length;
  const Vec3 x_axis = d1 * inverse_length, y_axis = cross(unit_normal, x_axis);
  const Vec2 p0{dot(w0, x_axis), dot(w0, y_axis)};
  if (p0.y >= radius) return false;
  // The third vertex' height from the triangle's area: a dot product would lose the digits of a sliver.
  const Vec2 to_third{dot(d2, x_axis), mapped_length * inverse_major * inverse_minor * inverse_minor * inverse_length};
  const Vec2 vertices[3] = {p0, {p0.x + edge1_length, p0.y}, {p0.x + to_third.x, p0.y + to_third.y}};
  const Vec2 directions[3] = {{edge1_length, 0}, {to_third.x - edge1_length, to_third.y}, {-to_third.x, -to_third.y}};

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
    const double per_length = 1 / std::sqrt(dot(start, start));
    arcs.start_cos[arcs.count] = start.x * per_length;
    arcs.start_sin[arcs.count] = start.y * per_length;
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
  arcs.center = ellipsoid.center + unmap(unit_normal * (offset / std::sqrt(support_squared)));
  arcs.e1 = edge1 * (radius * inverse_length);
  arcs.e2 = unmap(y_axis * radius);
  return true;
}

double area_per_angle_and_length(const Ellipsoid& ellipsoid, const Vec3& q, const Vec3& n) {
  // With p = q - centre, the surface is Q(p) = p.Kp = 1 and u_a + u_b = 2 major minor^2 Kp / (|q-a| |q-b|).
  // The arcs' centre is K-conjugate to the plane, so only the part v = e1 cos + e2 sin of p has an in-plane
  // gradient; it is conjugate to w = dq/dphi, and v.Kv = r^2 with r the circle's radius gives |P_T Kv| = r^2
  // |w| / |e1 x e2|. Finally |e1 x e2| = r^2 major minor^2 / sqrt(minor^2 + (n.(b-a)/2)^2): the shrinking
  // radius drops out of the ratio.
  const double across = dot(n, ellipsoid.b - ellipsoid.a);
  return std::sqrt(length_squared(q - ellipsoid.a) * length_squared(q - ellipsoid.b) /
                   (4 * ellipsoid.minor * ellipsoid.minor + across * across));
}

}  // namespace isochron
