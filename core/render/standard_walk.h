// The standard estimator: a random walk from the camera side with next-event estimation, combined with BSDF sampling
// by multiple importance sampling (balance heuristic, solid-angle measure).
#pragma once
#include "core/render/worker.h"

namespace isochron {

/// Extends the worker's path, whose vertex 0 is what looks and vertex 1 the first surface point, by up to
/// `max_bounces` scattering vertices. Calls emit(value) for every complete path: at that time the path ends on an
/// emitter, and value is contribution over density from vertex 1 on (seen from vertex 0, without the gate). Leaves
/// the path with its walk vertices removed beyond vertex 1.
template <class W, class Emit>
void walk_standard(W& worker, Path& path, int max_bounces, Rng& rng, Emit&& emit) {
  const PreparedScene& scene = worker.scene;
  const double upper = worker.gates.upper(), lower = worker.gates.lower();
  const int base = path.size();
  Rgb throughput(1.0);

  const auto in_reach = [&](double length) { return length >= lower && length <= upper; };
  const auto seen_emission = [&](double weight) {
    const SurfacePoint& x = path.back();
    if (!scene.emits(x.triangle) || !in_reach(path.length.back())) return;
    const Rgb radiance = scene.emitted(x, path.vertex[path.size() - 2].p - x.p);
    if (!radiance.is_black()) emit(throughput * radiance * weight);
  };

  seen_emission(1);
  for (int bounce = 1; bounce <= max_bounces; ++bounce) {
    if (path.length.back() + scene.distance_to_emitters(path.back().p) > upper) break;
    const SurfacePoint x = path.back();
    const Vec3 before = path.vertex[path.size() - 2].p;
    const Material& material = scene.material_of(x.triangle);

    // Next-event estimation.
    const double u0 = rng.uniform(), u1 = rng.uniform(), u2 = rng.uniform();
    double pdf_area;
    const SurfacePoint y = scene.sample_emitter(u0, u1, u2, pdf_area);
    const Scattering s(before, x, y.p);
    const double scattered = s.lobe(material) * std::abs(s.cos_i);
    const double cos_y = -dot(y.n, s.w_i);
    if (scattered > 0 && cos_y > 0 && in_reach(path.length.back() + s.distance_i)) {
      const double to_area = cos_y / (s.distance_i * s.distance_i);
      const double pdf_bsdf = s.pdf_towards_light(material) * to_area;
      path.push(scene, y);
      if (worker.matters(path) && worker.visible(x, y))
        emit(throughput * material.albedo * scene.shape_of(y.triangle).emission *
             (scattered * to_area / (pdf_area + pdf_bsdf)));
      path.pop();
    }

    // BSDF sampling.
    const double v0 = rng.uniform(), v1 = rng.uniform();
    const auto next = sample_direction(material, x.n, s.w_o, v0, v1);
    if (!next) break;
    throughput *= material.albedo * next->weight;
    if (throughput.is_black()) break;
    const auto hit = worker.trace(x, next->direction);
    if (!hit) break;
    path.push(scene, *hit);
    if (scene.emits(hit->triangle) && worker.matters(path)) {
      const double pdf_bsdf = next->pdf * solid_angle_to_area(x.p, *hit);
      seen_emission(pdf_bsdf / (pdf_bsdf + scene.emitter_pdf(hit->triangle)));
    }
    if (bounce < max_bounces && !survives(throughput, bounce, rng)) break;
  }
  while (path.size() > base) path.pop();
}

/// One camera path through `pixel`; contributions are scaled by `scale`.
template <class Sink>
void sample_standard(Worker<Sink>& worker, int pixel, double scale, Rng& rng) {
  const CameraModel& camera = worker.scene.camera;
  const double u = pixel % camera.width + rng.uniform(), v = pixel / camera.width + rng.uniform();
  const auto hit = worker.trace_camera(camera.direction(u, v));
  if (!hit) return;
  SurfacePoint eye;
  eye.p = camera.position;
  worker.path.start(eye, 0);
  worker.path.push(worker.scene, *hit);
  walk_standard(worker, worker.path, worker.options.max_bounces, rng, [&](const Rgb& value) {
    worker.emit(worker.path, pixel, value * scale, worker.path.length.back(), GateUse::value_and_slope);
  });
}

}  // namespace isochron
