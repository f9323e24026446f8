#include "core/techniques/worker.h"

namespace isochron {

Worker::Worker(const PreparedScene& prepared, const GateSet& gate_set, const EstimatorOptions& estimator,
               const GatePick& gate_pick, Sink& target)
    : scene(prepared),
      gates(gate_set),
      options(estimator),
      pick(gate_pick),
      balance(prepared, gate_pick),
      sink(target),
      differential_sink(target.differential()),
      area_steps(prepared.hidden.steps(estimator, differential_sink)),
      path(estimator.max_bounces) {}

void Worker::start_at_sensor(Path& sensor_path, int pixel) const {
  sensor_path.start(scene.sensor_point(pixel), scene.extra_length(pixel));
}

double Worker::start_path(int pixel, Rng& rng, double hidden) {
  start_at_sensor(path, pixel);
  if (scene.captures()) return start_at_wall(pixel, rng, hidden);
  const auto point = trace_camera(direction_through(pixel, rng));
  if (point) path.push(scene, *point);
  return point.has_value() ? 1 : 0;
}

double Worker::start_at_wall(int pixel, Rng& rng, double hidden) {
  const SurfacePoint s = path.back();
  // One number for the choice and for what is chosen: so the points of each way remain as evenly spread.
  double u0 = rng.fine_uniform();
  const double u1 = rng.uniform();
  const bool by_area = u0 < hidden;
  u0 = by_area ? u0 / hidden : (u0 - hidden) / (1 - hidden);
  SurfacePoint x;
  if (by_area) {
    x = scene.sample_hidden(u0, u1);
  } else {
    const Vec3 w = sample_cosine(s.n, u0, u1);
    const auto hit = scene.end_point(closest_hit(s, w), s.p, w);
    if (!hit) return 0;
    x = *hit;
  }
  const Vec3 d = x.p - s.p;
  const double r = length(d), cos_x = -dot(x.n, d);
  if (!(r > 0) || (!(cos_x > 0) && !scene.two_sided(x.triangle) && !scene.transparent(x.triangle))) return 0;
  const double shortest = r + length(x.p - scene.scene.capture->spot_of(pixel).p) * scene.least_index();
  if (path.length.back() + shortest > gates.upper()) return 0;
  const double received = scene.importance(pixel, d / r) * solid_angle_to_area(s.p, x);
  if (!(received > 0) || by_area != scene.hidden.takes(x.triangle, hidden, received)) return 0;
  if (by_area && !visible(s, x)) return 0;
  path.push(scene, x, r);
  return received / scene.hidden.next_vertex_pdf(x.triangle, hidden, received);
}

void Worker::emit(const Path& p, int pixel, const Rgb& value, double length, GateUse use) {
  sink.note_path(p);
  if (differential_sink) {
    differentiate(p, pixel, false, differential);
    if (differential.empty()) return;
    sink.bind(differential);
    // Where its flow keeps the length, gates count by their values alone.
    if (p.size() > 2 && scene.flows.keep_length()) use = GateUse::value_only;
  }
  sink.add(pixel, value, length, use);
}

void Worker::differentiate(const Path& p, int pixel, bool length_only, LocalDifferential& out) {
  differentiate_path(scene, pixel, p.vertex.data(), p.size(), length_only, out);
  counts.segments += p.size() - 1;
}

void Worker::emit_length_rate(const Path& p, int pixel, int gate, const Rgb& value) {
  sink.note_path(p);
  differentiate(p, pixel, true, differential);
  if (differential.empty()) return;
  sink.bind(differential);
  sink.add_length_rate(pixel, gate, value);
}

void Worker::emit_length_flux(const Path& p, int pixel, const Rgb& value, double length) {
  sink.note_path(p);
  differentiate(p, pixel, true, of_length);
  differential.clear();
  differential.add_length(of_length, 1);
  if (differential.empty()) return;
  sink.bind(differential);
  sink.add(pixel, value, length, GateUse::value_only);
}

std::optional<NextVertex> trace_next_vertex(Worker& worker, const SurfacePoint& x, const Vec3& w_back, Rgb& throughput,
                                            Rng& rng, TransportMode mode) {
  const auto next = sample_bsdf(worker.scene, x, w_back, throughput, rng, mode);
  if (!next) return std::nullopt;
  const auto hit = worker.trace(x, next->direction);
  if (!hit) return std::nullopt;
  return NextVertex{*hit, next->direction, next->pdf};
}

bool append_vertex(Worker& worker, Path& path, Rgb& throughput, Rng& rng) {
  const SurfacePoint x = path.back();
  const Vec3 w_back = normalize(path.vertex[path.size() - 2].p - x.p);
  const auto next = trace_next_vertex(worker, x, w_back, throughput, rng);
  if (next) path.push(worker.scene, next->point);
  return next.has_value();
}

}  // namespace isochron
