// Boundary segments of light straight from an emitter, on paths of a given length (theory section 7). One unknown is solved for: of the edge
// point and both image coordinates of D, or of the edge point and the two of S.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/progress.h"
#include "core/base/quadratic.h"
#include "core/techniques/cast_shadow.h"
#include "core/techniques/secondary_boundary.h"
#include "core/techniques/shadow_line.h"
#include "core/techniques/shadowed_length.h"

namespace isochron {
namespace {

/// Whether both triangles lie in one plane and face the same way.
bool coplanar(const PreparedScene& scene, int a, int b) {
  if (!face_alike(scene.normal(a), scene.normal(b))) return false;
  const auto corners = scene.corners(b);
  const double size =
      length(corners[1] - corners[0]) + length(corners[2] - corners[0]) + length(corners[0] - scene.corners(a)[0]);
  return std::abs(scene.height_over(a, corners[0])) <= kCoplanarAngle * size;
}

/// Probability of the point's edge over the density of the point along it, both as `warp` draws them.
double edge_over_point(const Warp& warp, const BoundaryEdges::Pick& y) {
  return (warp.below(y.begin + y.share) - warp.below(y.begin)) / (y.share * warp.density(y.x()));
}

}  // namespace

void SecondaryBoundary::connect_edge_at_length(int pixel, const Rgb& throughput, double tau, Rng& rng) {
  const double u_edge = rng.fine_uniform(), u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
  double pdf_area;
  const int emitter = scene_.sample_emitter(u0, u1, u2, pdf_area).triangle;
  if (is_light(emitter)) return;
  Segment g;
  const int table = camera_table(pixel, worker_.path.size() - 1);
  g.y = edges_.sample_secondary(guide_.warp(table).sample(u_edge));
  const double left = tau - worker_.path.length.back();
  const ShadowLine line(scene_, worker_.path.back().p, *g.y.edge, emitter);
  if (!(left > 0) || !(line.height > 0)) return;
  // height^2 |p|^2 = left^2 (n.p)^2 with p = a + s c.
  const double h2 = line.height * line.height, l2 = left * left;
  const double an = dot(line.a, line.n), cn = dot(line.c, line.n);
  const double q2 = h2 * dot(line.c, line.c) - l2 * cn * cn, q1 = h2 * dot(line.a, line.c) - l2 * an * cn,
               q0 = h2 * dot(line.a, line.a) - l2 * an * an;
  const auto roots = quadratic_roots(q2, q1, q0);
  if (!roots) return;
  for (const double s : *roots) {
    if (!(s > 0 && s < 1) || !line.casts(s)) continue;
    g.y.s = s;
    g.y.y = g.y.edge->point(s);
    if (deliver_at_length(g, pixel, emitter, throughput, tau, rng)) worker_.sink.note_guide(table, g.y.x());
  }
}

bool SecondaryBoundary::deliver_at_length(Segment& g, int pixel, int emitter, const Rgb& throughput, double tau,
                                          Rng& rng) {
  return join_camera_path(g, pixel, throughput) && g.light.triangle == emitter &&
         deliver_at_length(g, Found::from_camera, tau, draw_in_line(g, connections_[0], tau, rng));
}

bool SecondaryBoundary::deliver_at_length(const Segment& g, Found found, double tau, double in_line) {
  const Connection& c = connections_[0];
  const BoundaryDensities pdf = densities(g, c, tau, in_line);
  const Rgb radiance = scene_.emitted(g.light, -g.w);
  if (!((found == Found::from_edge ? pdf.edge_at_length : pdf.camera_at_length) > 0) || radiance.is_black())
    return false;
  const LocalDifferential& differential = with_kept_length(g, c, found);
  if (differential.empty()) return false;
  worker_.sink.bind(differential);
  worker_.sink.note_boundary(c.bounces, g.y.edge->face[0], pdf.camera_part());
  worker_.sink.add(c.pixel, c.value * radiance * (found == Found::from_edge ? pdf.of_edge() : pdf.of_camera()), tau,
                   GateUse::value_only);
  return true;
}

void SecondaryBoundary::connect_pixel_at_length(int pixel, int axis, double scale, double tau, Rng& rng) {
  const double u_edge = rng.fine_uniform(), other = rng.uniform(), start = rng.uniform();
  const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
  double pdf_area;
  const int emitter = scene_.sample_emitter(u0, u1, u2, pdf_area).triangle;
  if (is_light(emitter)) return;
  const CameraModel& camera = scene_.camera;
  std::array<double, 2> image{static_cast<double>(pixel % camera.width), static_cast<double>(pixel / camera.width)};
  const double border = image[axis];
  image[1 - axis] += other;
  const auto triangle_at = [&](double x) {
    std::array<double, 2> at = image;
    at[axis] = x;
    return worker_.closest_camera_hit(camera.direction(at[0], at[1]));
  };
  const int triangle = triangle_at(border + start);
  if (triangle < 0) return;
  const auto in_plane = [&](int t) { return t >= 0 && (t == triangle || coplanar(scene_, triangle, t)); };
  Segment g;
  const int table = camera_table(pixel, 1);
  g.y = edges_.sample_secondary(guide_.warp(table).sample(u_edge));
  const auto root = ShadowedLength(scene_, triangle, g.y.y, emitter).solve(image, axis, tau);
  const int met = root ? triangle_at(*root) : -1;
  if (!in_plane(met)) return;
  image[axis] = *root;
  const auto d = scene_.end_point(met, camera.position, camera.direction(image[0], image[1]));
  if (!d || camera.project(d->p) != pixel || !sees_outside(*d)) return;
  worker_.start_at_sensor(worker_.path, pixel);
  worker_.path.push(scene_, *d);
  // One over the probability to start in the plane, which nobody knows: the mean number of trials until one does.
  int trials = 1;
  for (; !in_plane(triangle_at(border + rng.uniform())); ++trials) throw_if_stopped();
  camera_densities_ = {};
  if (deliver_at_length(g, pixel, emitter, Rgb(scale * trials), tau, rng)) worker_.sink.note_guide(table, g.y.x());
}

void SecondaryBoundary::connect_lamp_at_length(double scale, Rng& rng) {
  const double u_edge = rng.fine_uniform(), start = rng.uniform(), gate_pick = rng.uniform(), u = rng.uniform();
  const double pick = rng.uniform();
  const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
  const double tau = worker_.pick.sample_length(GatePick::kImage, gate_pick, u).value_or(0);
  double pdf_area;
  const SurfacePoint lamp = scene_.sample_emitter(u0, u1, u2, pdf_area);
  if (!(tau > 0) || is_light(lamp.triangle)) return;
  Segment g;
  g.y = edges_.sample_secondary(edge_warp().sample(u_edge));
  find_in_line(g, lamp, start);
  if (in_line_.empty()) return;
  const auto count = static_cast<double>(in_line_.size());
  const int triangle = in_line_[std::min(static_cast<std::size_t>(pick * count), in_line_.size() - 1)];
  const CastShadow shadow(scene_, lamp, *g.y.edge, triangle);
  const auto roots = shadow.at_length(scene_.camera.position, tau);
  if (!roots || !shadow.within(start)) return;
  for (const double s : *roots) {
    if (!shadow.within(s) || !aim(g, lamp, s) || !find_light_end(g) || g.light.triangle != lamp.triangle) continue;
    if (!find_camera_end(g) || g.camera_end.triangle != triangle) continue;
    connections_.clear();
    const double random = g.y.pdf * edge_warp().density(g.y.x()) * direction_pdf(g);
    walk_to_camera(g, GatePick::kImage, scale * g.sine / random, 1, rng);
    if (!connections_.empty() && deliver_at_length(g, Found::from_edge, tau, 1 / count))
      worker_.sink.note_guide(BoundaryGuide::table(Technique::from_edge), g.y.x());
  }
}

bool SecondaryBoundary::aim(Segment& g, const SurfacePoint& lamp, double s) {
  g.y.s = s;
  g.y.y = g.y.edge->point(s);
  g.w = lamp.p - g.y.y;
  g.r_s = length(g.w);
  g.w *= 1 / g.r_s;
  return g.r_s > 0 && dot(lamp.n, g.w) < 0 && g.orient();
}

void SecondaryBoundary::find_in_line(Segment& g, const SurfacePoint& lamp, double s) {
  in_line_.clear();
  if (!aim(g, lamp, s)) return;
  const Vec3 start = g.offset_ray_origin(scene_.caster.offset());
  ++worker_.counts.rays;
  // Onwards only: a ray that is moved off one of two surfaces that cross may begin before the other.
  double reached = -std::numeric_limits<double>::infinity();
  for (int t = scene_.first_hit(start, -g.w); t >= 0;) {
    const SurfacePoint x = scene_.point_on_triangle(t, start, -g.w);
    const double distance = dot(start - x.p, g.w);
    if (!(distance > reached)) break;
    reached = distance;
    if (faces(t, g.w)) in_line_.push_back(t);
    t = worker_.closest_hit(x, -g.w);
  }
}

BoundaryDensities SecondaryBoundary::densities(const Segment& g, const Connection& c, double length,
                                               double in_line) const {
  const bool straight = length > 0;
  return {.camera_over_edge = c.camera_over_edge,
          .camera_at_length = straight ? length_over_random(g, c, length) : 0,
          .edge_at_length = straight && in_line > 0 ? in_line * length_over_direction(g, c, length) : 0,
          .random = !(straight && c.bounces <= at_length_alone_)};
}

double SecondaryBoundary::draw_in_line(const Segment& g, const Connection& c, double length, Rng& rng) {
  if (!edge_at_length_ || c.bounces != 1 || !scene_.emits(g.light.triangle)) return 0;
  if (!(worker_.pick.length_pdf(GatePick::kImage, length) > 0)) return 0;
  const CastShadow shadow(scene_, g.light, *g.y.edge, g.camera_end.triangle);
  if (!(shadow.part() > 0)) return 0;
  Segment at = g;
  find_in_line(at, g.light, shadow.point(rng.uniform()));
  const bool found = std::ranges::find(in_line_, g.camera_end.triangle) != in_line_.end();
  return found ? 1 / static_cast<double>(in_line_.size()) : 0;
}

double SecondaryBoundary::length_over_random(const Segment& g, const Connection& c, double length) const {
  if (!at_length_ || !scene_.emits(g.light.triangle) || !scene_.outside(g.camera_end, g.light)) return 0;
  const ShadowLine line(scene_, g.camera_end.p, *g.y.edge, g.light.triangle);
  const int t = g.light.triangle;
  double rate = edge_over_point(camera_warp(c.pixel, c.bounces), g.y) * line.distance_rate(g.y.s);
  if (c.bounces == 1 && !scene_.captures() && sees_outside(g.camera_end)) rate += rate_in_pixel(g, c.pixel);
  return rate * scene_.emitter_pdf(t) * scene_.area(t) * worker_.pick.length_pdf(c.pixel, length);
}

double SecondaryBoundary::length_over_direction(const Segment& g, const Connection& c, double length) const {
  const int t = g.light.triangle;
  const double cosine = -dot(g.light.n, g.w);
  if (!edge_at_length_ || c.bounces != 1 || !scene_.emits(t) || !(cosine > 0)) return 0;
  if (!scene_.outside(g.camera_end, g.light) || !sees_outside(g.camera_end)) return 0;
  const CastShadow shadow(scene_, g.light, *g.y.edge, g.camera_end.triangle);
  if (!shadow.within(g.y.s)) return 0;
  const double aimed_pdf = scene_.emitter_pdf(t) * g.r_s * g.r_s / cosine;
  return edge_over_point(edge_warp(), g.y) * shadow.length_rate(scene_.camera.position, g.y.s) * shadow.part() *
         aimed_pdf / direction_pdf(g) * worker_.pick.length_pdf(GatePick::kImage, length);
}

double SecondaryBoundary::rate_in_pixel(const Segment& g, int pixel) const {
  constexpr double kSame = 1e-6;  // pixels; several lengths may be right within a pixel, of which one is found
  const CameraModel& camera = scene_.camera;
  const std::array<double, 2> image = camera.image_point(g.camera_end.p);
  const ShadowedLength lengths(scene_, g.camera_end.triangle, g.y.y, g.light.triangle);
  const auto here = lengths.at(image);
  if (!here) return 0;
  double rate = 0;
  for (int axis = 0; axis < 2; ++axis) {
    std::array<double, 2> from = image;
    from[axis] = axis == 0 ? pixel % camera.width : pixel / camera.width;
    const auto root = lengths.solve(from, axis, here->length);
    if (root && std::abs(*root - image[axis]) < kSame) rate += std::abs(here->rate[axis]);
  }
  return rate;
}

}  // namespace isochron
