#include "core/techniques/ellipsoidal.h"

#include <algorithm>
#include <cmath>

#include "core/techniques/ellipsoidal_impl.h"

namespace isochron {

void EllipsoidalConnections::sample_from_camera(double scale, Rng& rng) {
  worker_.start_at_sensor(worker_.path, 0);
  draw_targets(pass_, worker_.gates, worker_.pick, GatePick::kImage, rng, targets_);
  light_is_traced_ = false;
  for (const TargetLength& target : targets_) {
    if (scene_.emitters.seen_by_camera) connect_emitter(target, GatePick::kImage, Rgb(scale), rng);
    // Of paths that keep their lengths only those that the camera sees an emitter by have a slope.
    const bool has_slope = !(target.pair && scene_.flows.keep_length());
    if (worker_.options.max_bounces >= 1 && has_slope) connect_surface(target, GatePick::kImage, Rgb(scale), rng);
    if (connects_light() && has_slope) connect_light(target, GatePick::kImage, Rgb(scale), rng);
    if (worker_.options.max_bounces >= 1 && has_flux(target)) {
      connect_front(target, GatePick::kImage, Rgb(scale), rng);
      connect_border(target, GatePick::kImage, Rgb(scale), rng);
    }
  }
}

void EllipsoidalConnections::sample_walk(int pixel, double scale, Rng& rng) {
  const int max_bounces = worker_.options.max_bounces;
  draw_targets(pass_, worker_.gates, worker_.pick, pixel, rng, targets_);
  if (targets_.empty() || max_bounces < 1) return;
  if (scene_.captures()) {
    worker_.start_at_sensor(worker_.path, pixel);
    for (const TargetLength& target : targets_) connect_surface(target, pixel, Rgb(scale), rng);
    if (max_bounces == 1) return;
  }
  const double weight = worker_.start_path(pixel, rng);
  if (weight > 0) connect_along(pixel, scale * weight, max_bounces, rng);
}

void EllipsoidalConnections::gather(std::span<const double> lengths, int max_bounces, Rng& rng) {
  targets_.clear();
  for (std::size_t i = 0; i < lengths.size(); ++i) {
    if (!(lengths[i] > 0)) continue;
    TargetLength t;
    t.tau[0] = lengths[i];
    t.present[0] = true;
    t.index = static_cast<int>(i);
    t.scale = 1;
    targets_.push_back(t);
  }
  connect_along(-1, 1, max_bounces, rng);
}

void EllipsoidalConnections::connect_along(int pixel, double scale, int max_bounces, Rng& rng) {
  Path& path = worker_.path;
  light_is_traced_ = false;
  Rgb throughput(1.0);
  for (int bounce = 1; bounce <= max_bounces; ++bounce) {
    const double needed = path.length.back() + scene_.distance_to_emitters(path.back().p);
    bool reachable = false;
    for (const TargetLength& target : targets_) {
      if (!(needed < target.longest())) continue;
      reachable = true;
      connect_emitter(target, pixel, throughput * scale, rng);
      if (bounce < max_bounces) connect_surface(target, pixel, throughput * scale, rng);
      if (connects_light()) connect_light(target, pixel, throughput * scale, rng);
      if (!has_flux(target)) continue;
      borders_.sample(target.tau[0], pixel, throughput * (scale * target.scale), rng);
      if (bounce == max_bounces) continue;
      connect_front(target, pixel, throughput * scale, rng);
      connect_border(target, pixel, throughput * scale, rng);
    }
    if (!reachable || bounce == max_bounces || !russian_roulette(throughput, bounce, rng)) return;
    if (!append_vertex(worker_, path, throughput, rng)) return;
  }
}

bool EllipsoidalConnections::any_arc_contributes(int emitter_triangle) const {
  if (!worker_.differential_sink || receiver_) return true;
  return path_has_gradient(scene_, worker_.path, worker_.path.size() - 1, emitter_triangle);
}

void EllipsoidalConnections::connect_surface(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng) {
  const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
  double pdf_y = 1;
  const SurfacePoint y =
      scene_.captures() ? scene_.point_of_light(scene_.spot_of(pixel)) : scene_.sample_emitter(u0, u1, u2, pdf_y);
  Path& path = worker_.path;
  connect_arcs(target, 0, {y.p, y.n, 0, 1, length_squared(y.n) > 0}, any_arc_contributes(y.triangle), pixel,
               throughput * (1 / pdf_y), rng, y, leaves_emitter(),
               [&](int i, const ArcPoint& q, double inverse_probability) {
                 if (!path.is_confocal_return(y) && !worker_.visible(q.point, y)) return;
                 path.push(scene_, y);
                 deliver(target, i, q, inverse_probability, path.size() - 2);
                 path.pop();
               });
}

void EllipsoidalConnections::connect_light(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng) {
  if (!light_is_traced_) light_.trace(worker_, rng);
  light_is_traced_ = true;
  const int picked = light_.pick(rng.uniform());
  Path& path = worker_.path;
  // Its number of vertices, and q, have to be left.
  if (picked < 0 || path.size() - 1 + picked + 2 > worker_.options.max_bounces) return;
  const LightVertex& z = light_.vertices()[picked];
  const bool any_arc = light_.contributes(worker_, path, picked);
  connect_arcs(
      target, z.length, scattering_focus(z.point, z.towards_light), any_arc, pixel,
      throughput * (1 / LightWalk::pick_probability(picked)), rng, z.point,
      [&](const SurfacePoint&, const Vec3& w) { return z.leaving(scene_, w); },
      [&](int i, const ArcPoint& q, double inverse_probability) {
        if (!worker_.visible(q.point, z.point)) return;
        const int on_arc = path.size() - 1;
        light_.append(scene_, picked, path);
        deliver(target, i, q, inverse_probability, on_arc);
        light_.remove(picked, path);
      });
}

template <class Leaving, class Complete>
void EllipsoidalConnections::connect_arcs(const TargetLength& target, double way_of_light,
                                          const EllipsoidBvh::Focus& other, bool any_arc, int pixel, const Rgb& factor,
                                          Rng& rng, const SurfacePoint& y, Leaving&& leaving, Complete&& complete) {
  const double along = rng.uniform();
  const double pick = rng.uniform(), thinning = rng.uniform();
  const Path& path = worker_.path;
  const SurfacePoint& x = path.back();
  const double way = path.length.back() + way_of_light;
  const double high = target.longest() - way, low = target.shortest() - way;
  const Foci foci(x.p, y.p);
  if (!(high > foci.distance)) return;
  const Ellipsoid ellipsoids[2] = {{foci, target.tau[0] - way}, {foci, target.tau[1] - way}};
  find_candidates(scene_.hierarchy(any_arc ? PreparedScene::Part::all : PreparedScene::Part::moving), other, low, high,
                  thinning);
  const auto choices = choose(pick, 2, [&](int t, ArcPair& arcs) {
    const double side_x = scene_.height_over(t, x.p), side_y = scene_.height_over(t, y.p);
    const bool two_sided = scene_.two_sided(t);
    if (!((side_x > 0 && side_y > 0) || (two_sided && side_x < 0 && side_y < 0))) return;
    const FocalTriangle triangle = scene_.focal_triangle(foci, t);
    for (int i = 0; i < 2; ++i)
      if (target.present[i] && ellipsoids[i].valid())
        surface_arc_point(
            ellipsoids[i], triangle, t, [&](const SurfacePoint&) { return y; }, leaving, along, pixel, factor,
            arcs.side[i]);
  });
  for_each_seen(choices, complete);
}

void EllipsoidalConnections::find_candidates(const EllipsoidBvh& bvh, const EllipsoidBvh::Focus& other, double low,
                                             double high, double thinning) {
  worker_.candidates.clear();
  worker_.inverse_probability.clear();
  if (worker_.options.pick == ArcPick::uniform)
    bvh.query_surfaces(worker_.path.back().p, other.p, low, high, worker_.candidates);
  else
    bvh.sample_surfaces(focus(), other, low, high, thinning, worker_.candidates, worker_.inverse_probability);
  for (const int t : worker_.candidates) scene_.prefetch(t);
  const Path& path = worker_.path;
  if (path.size() > 1) back_ = normalize(path.vertex[path.size() - 2].p - path.back().p);
  worker_.counts.arcs += 1 + worker_.candidates.size();
}

Directions EllipsoidalConnections::scattering_to(const Vec3& w) const {
  return Directions::between(worker_.path.back().n, w, back_);
}

EllipsoidBvh::Focus EllipsoidalConnections::focus() const {
  const Path& path = worker_.path;
  const SurfacePoint& x = path.back();
  if (path.size() == 1 && scene_.captures()) return {x.p, x.n, 0, 1, true};
  if (path.size() == 1) {
    const double cosine = scene_.camera.cos_corner;
    return {x.p, scene_.camera.forward, cosine, std::sqrt(1 - cosine * cosine), false};
  }
  const Vec3& before = path.vertex[path.size() - 2].p;
  return scattering_focus(x, before - x.p);
}

void EllipsoidalConnections::connect_emitter(const TargetLength& target, int pixel, const Rgb& throughput, Rng& rng) {
  const double along = rng.uniform();
  const double pick = rng.uniform(), thinning = rng.uniform();
  const Path& path = worker_.path;
  const SurfacePoint& x = path.back();
  const double before = path.length.back();
  const double high = 2 * (target.longest() - before), low = 2 * (target.shortest() - before);
  if (!(high > 0)) return;
  const EllipsoidBvh::Focus anywhere{x.p, {0, 0, 0}, 0, 1, false};
  find_candidates(scene_.hierarchy(PreparedScene::Part::emitting), anywhere, low, high, thinning);

  const Foci foci(x.p, x.p);
  const Ellipsoid spheres[2] = {{foci, 2 * (target.tau[0] - before)}, {foci, 2 * (target.tau[1] - before)}};
  const auto choices = choose(pick, 1, [&](int t, ArcPair& arcs) {
    if (!(scene_.height_over(t, x.p) > 0) || !any_arc_contributes(t)) return;
    const FocalTriangle triangle = scene_.focal_triangle(foci, t);
    for (int i = 0; i < 2; ++i)
      if (target.present[i] && spheres[i].valid())
        emitter_arc_point(spheres[i], triangle, t, along, pixel, throughput, arcs.side[i]);
  });
  for_each_seen(choices, [&](int i, const ArcPoint& y, double inverse_probability) {
    deliver(target, i, y, inverse_probability, worker_.path.size() - 1);
  });
}

void EllipsoidalConnections::emitter_arc_point(const Ellipsoid& sphere, const FocalTriangle& triangle, int t,
                                               double along, int pixel, const Rgb& throughput, ArcPoint& out) const {
  EllipseArcs arcs;
  if (!clip_ellipse(sphere, triangle, arcs)) return;
  const SurfacePoint y{arcs.point_at(along), scene_.normal(t), t};
  const Path& path = worker_.path;
  const SurfacePoint& x = path.back();
  if (!scene_.outside(x, y)) return;
  const double distance = 0.5 * sphere.tau;
  const Vec3 w = (y.p - x.p) / distance;
  const double cos_y = -dot(y.n, w);
  if (!(cos_y > 0)) return;
  double carried = cos_y / (distance * distance);
  Rgb f(1.0);
  out.pixel = pixel;
  if (path.size() == 1) {
    out.pixel = scene_.camera.project(y.p);
    if (out.pixel < 0) return;
    carried *= scene_.camera.image_area_per_solid_angle(w);
  } else {
    const Directions at_x = scattering_to(w);
    carried *= std::abs(at_x.cos_i);
    f = bsdf_value(scene_, x, at_x);
  }
  if (!(carried > 0) || f.is_black()) return;
  // About the foot of x in the plane, dA = r dr dphi with r the distance.
  const double area = arcs.total_span * distance;
  out.pdf = 1 / area;
  out.value = throughput * f * scene_.emitted(y, -w) * (carried * area);
  out.point = y;
}

void EllipsoidalConnections::deliver(const TargetLength& target, int i, const ArcPoint& found,
                                     double inverse_probability, int on_arc) {
  if (!receiver_ && !worker_.contributes(worker_.path)) return;
  const double weight = receiver_ ? worker_.balance.gathered(worker_.path, on_arc, found.pdf)
                                  : worker_.balance.connection(worker_.path, found.pixel, target, i, on_arc, found.pdf);
  const Rgb value = found.value * (inverse_probability * weight * target.scale);
  if (receiver_)
    receiver_->take(target.index, worker_.path.size() - 2, value);
  else if (target.pair)
    worker_.emit_length_rate(worker_.path, found.pixel, target.gate, i == 0 ? value : value * -1.0);
  else
    worker_.emit(worker_.path, found.pixel, value, target.tau[0], pass_.use);
}

}  // namespace isochron
