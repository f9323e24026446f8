#include "core/techniques/light_walk.h"

#include <algorithm>

namespace isochron {

void LightWalk::trace(Worker& worker, Rng& rng) {
  const PreparedScene& scene = worker.scene;
  vertices_.clear();
  const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform(), u3 = rng.uniform(), u4 = rng.uniform();
  double pdf;
  emitter_ = scene.sample_emitter(u0, u1, u2, pdf);
  Vec3 w = scene.sample_emission(emitter_, u3, u4);
  const double cosine = is_light(emitter_.triangle) ? 1 : dot(emitter_.n, w);
  const double direction_pdf = scene.emission_pdf(emitter_, w);
  if (!(direction_pdf > 0) || scene.covered(emitter_, -w)) return;
  const Rgb emitted = scene.emitted(emitter_, w) * (cosine / (pdf * direction_pdf));
  // Roulette takes walks whose throughput starts at one.
  Rgb throughput(1.0);
  SurfacePoint from = emitter_;
  double length = 0;
  for (int bounce = 1;; ++bounce) {
    const auto z = worker.trace(from, w);
    if (!z) return;
    const double distance = isochron::length(z->p - from.p);
    if (!(distance > 0)) return;
    length += distance * scene.index_between(from, *z);
    const double to_camera = isochron::length(z->p - scene.camera.position) * scene.least_index();
    if (length + to_camera > worker.gates.upper()) return;
    vertices_.push_back({*z, -w, length, emitted * throughput});
    if (bounce == worker.options.max_bounces || !russian_roulette(throughput, bounce, rng)) return;
    const auto next = sample_bsdf(scene, *z, -w, throughput, rng, TransportMode::importance);
    if (!next) return;
    from = *z;
    w = next->direction;
  }
}

bool LightWalk::has_gradient(const PreparedScene& scene, int i) const {
  if (emitter_has_gradient(scene, emitter_.triangle)) return true;
  return std::any_of(vertices_.begin(), vertices_.begin() + i + 1,
                     [&](const LightVertex& z) { return scene.has_gradient(z.point.triangle); });
}

}  // namespace isochron
