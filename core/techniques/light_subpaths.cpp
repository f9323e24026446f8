#include "core/techniques/light_subpaths.h"

#include <cmath>

namespace isochron {

void LightSubpaths::sample(int pixel, double scale, double splat_scale, Rng& rng) {
  const int max_bounces = worker_.options.max_bounces;
  const Vec3 direction = worker_.direction_through(pixel, rng);
  trace_light(rng);
  if (light_.empty()) return;
  worker_.start_at_sensor(path_, pixel);
  join(-1, Rgb(1.0), splat_scale);
  if (max_bounces < 2) return;
  const auto x1 = worker_.trace_camera(direction);
  if (!x1) return;
  path_.push(scene_, *x1);
  Rgb throughput(1.0);
  for (int bounce = 1;; ++bounce) {
    join(pixel, throughput, scale);
    if (bounce + 1 == max_bounces || path_.length.back() > reach_.upper) return;
    if (!russian_roulette(throughput, bounce, rng) || !append_vertex(worker_, path_, throughput, rng)) return;
  }
}

void LightSubpaths::trace_light(Rng& rng) {
  light_.clear();
  const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform(), u3 = rng.uniform(), u4 = rng.uniform();
  double pdf;
  emitter_ = scene_.sample_emitter(u0, u1, u2, pdf);
  Vec3 w = scene_.sample_emission(emitter_, u3, u4);
  const double cosine = is_light(emitter_.triangle) ? 1 : dot(emitter_.n, w);
  const double direction_pdf = scene_.emission_pdf(emitter_, w);
  if (!(direction_pdf > 0)) return;
  const Rgb emitted = scene_.emitted(emitter_, w) * (cosine / (pdf * direction_pdf));
  // Roulette takes walks whose throughput starts at one.
  Rgb throughput(1.0);
  SurfacePoint from = emitter_;
  double length = 0;
  for (int bounce = 1;; ++bounce) {
    const auto z = worker_.trace(from, w);
    if (!z) return;
    const double distance = isochron::length(z->p - from.p);
    if (!(distance > 0)) return;
    length += distance * scene_.index_between(from, *z);
    if (length + isochron::length(z->p - scene_.camera.position) * scene_.least_index() > reach_.upper) return;
    light_.push_back({*z, -w, length, emitted * throughput});
    if (bounce == worker_.options.max_bounces || !russian_roulette(throughput, bounce, rng)) return;
    const auto next = sample_bsdf(scene_, *z, -w, throughput, rng, TransportMode::importance);
    if (!next) return;
    from = *z;
    w = next->direction;
  }
}

void LightSubpaths::join(int pixel, const Rgb& throughput, double scale) {
  const int camera_vertices = path_.size() - 1;
  const SurfacePoint x = path_.back();
  Vec3 back;
  if (camera_vertices > 0) back = normalize(path_.vertex[camera_vertices - 1].p - x.p);
  const int most = std::min<int>(light_.size(), worker_.options.max_bounces - camera_vertices);
  for (int i = 0; i < most; ++i) {
    const Vertex& z = light_[i];
    const Vec3 d = z.point.p - x.p;
    const double distance = isochron::length(d);
    if (!(distance > 0)) continue;
    if (!reach_.holds(path_.length.back() + distance * scene_.index_between(x, z.point) + z.length)) continue;
    const Vec3 w = d * (1 / distance);
    const int lands_on = pixel < 0 ? scene_.camera.project(z.point.p) : pixel;
    if (lands_on < 0) continue;
    const Directions at_z{z.point.n,          z.towards_light,         -w, dot(z.point.n, z.towards_light),
                          -dot(z.point.n, w), -dot(z.towards_light, w)};
    Rgb value = throughput * z.throughput * bsdf_value(scene_, z.point, at_z) *
                (scale * std::abs(at_z.cos_o) / (distance * distance));
    if (camera_vertices == 0) {
      value *= scene_.camera.image_area_per_solid_angle(w);
    } else {
      const Directions at_x{x.n, w, back, dot(x.n, w), dot(x.n, back), dot(w, back)};
      value *= bsdf_value(scene_, x, at_x) * std::abs(at_x.cos_i);
    }
    if (value.is_black()) continue;
    for (int k = i; k >= 0; --k) path_.push(scene_, light_[k].point);
    path_.push(scene_, emitter_);
    if (worker_.contributes(path_) && worker_.visible(x, z.point))
      worker_.emit(path_, lands_on, value, path_.length.back(),
                   worker_.balance.light(path_, lands_on, camera_vertices, pairs_));
    for (int k = i + 2; k > 0; --k) path_.pop();
  }
}

}  // namespace isochron
