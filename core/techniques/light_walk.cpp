#include "core/techniques/light_walk.h"

#include <algorithm>

namespace isochron {

void LightWalk::trace(Worker& worker, Rng& rng) {
  const PreparedScene& scene = worker.scene;
  vertices_.clear();
  step_to_emitter_ = -1;
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
  double length = 0, step_pdf = direction_pdf;
  for (int bounce = 1;; ++bounce) {
    const auto z = worker.trace(from, w);
    if (!z) return;
    const double distance = isochron::length(z->p - from.p);
    if (!(distance > 0)) return;
    length += distance * scene.index_between(from, *z);
    const double to_camera = isochron::length(z->p - scene.camera.position) * scene.least_index();
    if (length + to_camera > worker.gates.upper()) return;
    vertices_.push_back(
        {*z, -w, distance, length, emitted * throughput, {-1, step_pdf * solid_angle_to_area(from.p, *z)}});
    if (bounce == worker.options.max_bounces || !russian_roulette(throughput, bounce, rng)) return;
    const auto next = sample_bsdf(scene, *z, -w, throughput, rng, TransportMode::importance);
    if (!next) return;
    from = *z;
    w = next->direction;
    step_pdf = next->pdf;
  }
}

void LightWalk::append(const PreparedScene& scene, int i, Path& path) const {
  const int first = path.size();
  path.push(scene, vertices_[i].point);
  for (int k = i; k >= 0; --k) path.push(scene, k > 0 ? vertices_[k - 1].point : emitter_, vertices_[k].distance);
  // What was computed for a path by a vertex further on holds as well: the densities of both sides depend on two neighbours.
  for (int k = i; k >= 0; --k) {
    StepDensities& step = path.steps[first + i - k];
    step.from_light = vertices_[k].step.from_light;
    if (k + 2 <= i) step.from_camera = vertices_[k].step.from_camera;
  }
  if (i > 0) path.steps[first + i + 1].from_camera = step_to_emitter_;
}

void LightWalk::remove(int i, Path& path) {
  if (i > 0) step_to_emitter_ = path.steps[path.size() - 1].from_camera;
  for (int k = 0; k + 2 <= i; ++k) vertices_[k].step.from_camera = path.steps[path.size() - 2 - k].from_camera;
  for (int k = 0; k < i + 2; ++k) path.pop();
}

bool LightWalk::contributes(const Worker& worker, const Path& path, int i) const {
  const PreparedScene& scene = worker.scene;
  if (!worker.differential_sink || path_has_gradient(scene, path, path.size() - 1, emitter_.triangle)) return true;
  return std::any_of(vertices_.begin(), vertices_.begin() + i + 1,
                     [&](const LightVertex& z) { return scene.has_gradient(z.point.triangle); });
}

}  // namespace isochron
