#include "core/techniques/light_subpaths.h"

#include <algorithm>
#include <cmath>

namespace isochron {

void LightSubpaths::sample(int pixel, double scale, Rng& rng) {
  const int max_bounces = worker_.options.max_bounces;
  const Vec3 direction = worker_.direction_through(pixel, rng);
  light_.trace(worker_, rng);
  if (light_.vertices().empty()) return;
  worker_.start_at_sensor(path_, pixel);
  join(-1, Rgb(scale * worker_.pick.rate(pixel) / scene_.pixels()));
  if (max_bounces < 2) return;
  const auto x1 = worker_.trace_camera(direction);
  if (!x1) return;
  const double distance = length(x1->p - scene_.camera.position);
  if (!(distance > 0)) return;  // a camera on a surface sees nothing
  path_.push(scene_, *x1, distance);
  Rgb throughput(1.0);
  for (int bounce = 1;; ++bounce) {
    join(pixel, throughput * scale);
    if (bounce + 1 == max_bounces || path_.length.back() > reach_.upper) return;
    if (!russian_roulette(throughput, bounce, rng) || !append_vertex(worker_, path_, throughput, rng)) return;
  }
}

void LightSubpaths::join(int pixel, const Rgb& throughput) {
  const int camera_vertices = path_.size() - 1;
  const SurfacePoint x = path_.back();
  Vec3 back;
  if (camera_vertices > 0) back = normalize(path_.vertex[camera_vertices - 1].p - x.p);
  const int most = std::min<int>(light_.vertices().size(), worker_.options.max_bounces - camera_vertices);
  for (int i = 0; i < most; ++i) {
    const LightVertex& z = light_.vertices()[i];
    const Vec3 d = z.point.p - x.p;
    const double distance = length(d);
    if (!(distance > 0)) continue;
    if (!reach_.holds(path_.length.back() + distance * scene_.index_between(x, z.point) + z.length)) continue;
    const Vec3 w = d * (1 / distance);
    const int lands_on = pixel < 0 ? scene_.camera.project(z.point.p) : pixel;
    if (lands_on < 0) continue;
    Rgb value = throughput * z.leaving(scene_, -w) * (1 / (distance * distance));
    if (camera_vertices == 0) {
      value *= scene_.camera.image_area_per_solid_angle(w);
    } else {
      const Directions at_x = Directions::between(x.n, w, back);
      value *= bsdf_value(scene_, x, at_x) * std::abs(at_x.cos_i);
    }
    if (value.is_black()) continue;
    if (!light_.contributes(worker_, path_, i) || !worker_.visible(x, z.point)) continue;
    light_.append(scene_, i, path_);
    worker_.emit(path_, lands_on, value * worker_.balance.light(path_, lands_on, camera_vertices), path_.length.back(),
                 GateUse::value_and_slope);
    light_.remove(i, path_);
  }
}

}  // namespace isochron
