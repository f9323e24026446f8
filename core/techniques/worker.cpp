#include "core/techniques/worker.h"

namespace isochron {

Worker::Worker(const PreparedScene& prepared, const GateSet& gate_set, const EstimatorOptions& estimator,
               const GatePick& gate_pick, Sink& target)
    : scene(prepared),
      gates(gate_set),
      options(estimator),
      pick(gate_pick),
      techniques(prepared, gate_pick),
      sink(target),
      differential_sink(target.differential()),
      path(estimator.max_bounces) {}

void Worker::start_at_camera(Path& camera_path) const {
  SurfacePoint eye;
  eye.p = scene.camera.position;
  camera_path.start(eye, 0);
}

bool Worker::start_camera_path(int pixel, Rng& rng) {
  start_at_camera(path);
  const auto point = trace_camera(direction_through(pixel, rng));
  if (point) path.push(scene, *point);
  return point.has_value();
}

void Worker::emit(const Path& p, int pixel, const Rgb& value, double length, GateWeights use) {
  sink.note_path(p);
  if (differential_sink) {
    differentiate_path(scene, p.vertex.data(), p.size(), false, differential);
    if (differential.empty()) return;
    sink.bind(differential);
  }
  sink.add(pixel, value, length, use);
}

void Worker::emit_length_rate(const Path& p, int pixel, int gate, const Rgb& value) {
  sink.note_path(p);
  differentiate_path(scene, p.vertex.data(), p.size(), true, differential);
  if (differential.empty()) return;
  sink.bind(differential);
  sink.add_length_rate(pixel, gate, value);
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
