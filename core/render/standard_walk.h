// The standard estimator: a random walk from the camera side with next-event estimation, combined with BSDF sampling
// by multiple importance sampling (balance heuristic, solid-angle measure).
#pragma once
#include "core/render/worker.h"

namespace isochron {

/// Path lengths outside of which a complete path meets no gate.
struct LengthRange {
  double lower, upper;
  bool holds(double length) const { return length >= lower && length <= upper; }
};

/// Extends `path`, whose vertex 0 is what looks and vertex 1 the first surface point, by up to `max_bounces`
/// scattering vertices. Visits every complete path whose length is in `reach`: visitor.wants() is asked first, while
/// the path ends on the emitter; then visitor.take(value) gets contribution over density from vertex 1 on (seen from
/// vertex 0, without the gate). Leaves the path as it was.
template <class W, class Visitor>
void walk_standard(W& worker, Path& path, int max_bounces, LengthRange reach, Rng& rng, Visitor&& visitor) {
  const PreparedScene& scene = worker.scene;
  const int base = path.size();
  Rgb throughput(1.0);
  // Towards the vertex before the last, and how far away it is.
  Vec3 w_o = path.vertex[base - 2].p - path.back().p;
  double distance_o = length(w_o);
  w_o *= 1 / distance_o;

  const auto seen_emission = [&](double weight) {
    const SurfacePoint& x = path.back();
    if (!reach.holds(path.length.back()) || !visitor.wants()) return;
    const Rgb radiance = scene.emitted(x, w_o);
    if (!radiance.is_black()) visitor.take(throughput * radiance * weight);
  };

  if (scene.emits(path.back().triangle)) seen_emission(1);
  int light = scene.pick_emitter(rng.uniform());
  for (int bounce = 1; bounce <= max_bounces; ++bounce) {
    if (path.length.back() + scene.distance_to_emitters(path.back().p) > reach.upper) break;
    const SurfacePoint& x = path.back();
    const Material& material = scene.material_of(x.triangle);

    // Next-event estimation.
    const double u1 = rng.uniform(), u2 = rng.uniform();
    const SurfacePoint y = scene.point_on_emitter(light, u1, u2);
    const Scattering s(x, w_o, distance_o, y.p);
    const double scattered = s.lobe(material) * std::abs(s.cos_i);
    const double cos_y = -dot(y.n, s.w_i);
    if (scattered > 0 && cos_y > 0 && reach.holds(path.length.back() + s.distance_i * scene.index_between(x, y))) {
      const double to_area = cos_y / (s.distance_i * s.distance_i);
      const double pdf_bsdf = s.pdf_towards_light(material) * to_area;
      path.push(scene, y, s.distance_i);
      if (visitor.wants() && worker.visible(x, y))
        visitor.take(throughput * material.albedo * scene.shape_of(y.triangle).emission *
                     (scattered * to_area / (scene.emitter_pdf(light) + pdf_bsdf)));
      path.pop();
    }

    // BSDF sampling.
    const auto next = turn(scene, x, w_o, throughput, rng);
    if (!next) break;
    if (bounce < max_bounces) light = scene.pick_emitter(rng.uniform());
    const auto hit = worker.trace(x, next->direction);
    if (!hit) break;
    w_o = -next->direction;
    distance_o = length(hit->p - x.p);
    path.push(scene, *hit, distance_o);
    if (scene.emits(hit->triangle)) {
      const double pdf_bsdf = next->pdf * std::abs(dot(hit->n, w_o)) / (distance_o * distance_o);
      seen_emission(pdf_bsdf / (pdf_bsdf + scene.emitter_pdf(hit->triangle)));
    }
    if (bounce < max_bounces && !survives(throughput, bounce, rng)) break;
  }
  while (path.size() > base) path.pop();
}

/// One camera path through `pixel`; contributions are scaled by `scale`. `pairs`: the slope of the gate is shared with
/// ellipsoidal connections in coupled pairs.
template <class Sink>
void sample_standard(Worker<Sink>& worker, int pixel, double scale, bool pairs, Rng& rng) {
  struct Visitor {
    Worker<Sink>& worker;
    int pixel;
    double scale;
    bool pairs;
    bool wants() const { return worker.matters(worker.path); }
    void take(const Rgb& value) {
      GateWeights weights;
      if (const double share = worker.ellipsoidal_share; share > 0) {
        // This technique's share in the balance heuristic, over the share of the samples.
        weights.value = (1 - worker.techniques.ellipsoidal_weight(worker.path, pixel, share, 1)) / (1 - share);
        weights.slope =
            pairs
                ? (1 - worker.techniques.ellipsoidal_weight(worker.path, pixel, share, worker.pair_gain)) / (1 - share)
                : weights.value;
      }
      worker.emit(worker.path, pixel, value * scale, worker.path.length.back(), weights);
    }
  };
  if (!worker.start_camera_path(pixel, rng)) return;
  walk_standard(worker, worker.path, worker.options.max_bounces, {worker.gates.lower(), worker.gates.upper()}, rng,
                Visitor{worker, pixel, scale, pairs});
}

}  // namespace isochron
