// What one strand of work carries from sample to sample, and how complete paths reach a sink.
#pragma once
#include "core/base/random.h"
#include "core/films/breakdown_sinks.h"
#include "core/films/sinks.h"
#include "core/paths/options.h"
#include "core/techniques/techniques.h"

namespace isochron {

template <class Sink>
struct Worker {
  const PreparedScene& scene;
  const GateSet& gates;
  const EstimatorOptions& options;
  const GatePick& pick;
  double ellipsoidal_share = 0;  ///< of the samples; the others are standard
  ConnectionRates rates = {};    ///< of ellipsoidal connections
  double pair_gain = 1;          ///< by how much pairs count for more than their density
  Techniques techniques;
  Sink sink;
  Path path;
  LocalDifferential differential;
  std::vector<int> candidates;              ///< triangles that may hold an arc
  std::vector<double> inverse_probability;  ///< of each candidate to be one, for the pick by contribution
  long long rays = 0;
  long long arcs = 0;  ///< triangles looked at for arcs, and the queries that found them

  Worker(const PreparedScene& prepared, const GateSet& gate_set, const EstimatorOptions& estimator,
         const GatePick& gate_pick, Sink target)
      : scene(prepared),
        gates(gate_set),
        options(estimator),
        pick(gate_pick),
        techniques(prepared, gate_pick),
        sink(std::move(target)),
        path(estimator.max_bounces) {}

  double work() const { return isochron::work(rays, arcs); }

  bool visible(const SurfacePoint& x, const SurfacePoint& y) {
    ++rays;
    return scene.visible(x, y);
  }
  bool visible_from_camera(const SurfacePoint& x) {
    ++rays;
    return scene.visible_from_camera(x);
  }
  int cast(const SurfacePoint& x, const Vec3& w) {
    ++rays;
    return scene.cast(x, w);
  }
  int cast_within(const SurfacePoint& x, const Vec3& w, double distance) {
    ++rays;
    return scene.cast_within(x, w, distance);
  }
  int cast_camera(const Vec3& direction) {
    ++rays;
    return scene.cast_camera(direction);
  }
  std::optional<SurfacePoint> trace(const SurfacePoint& x, const Vec3& w) {
    return scene.end_point(cast(x, w), x.p, w);
  }
  std::optional<SurfacePoint> trace_camera(const Vec3& direction) {
    return scene.end_point(cast_camera(direction), scene.camera.position, direction);
  }

  /// Of a ray from the camera through a random point of the pixel; unit.
  Vec3 direction_through(int pixel, Rng& rng) const {
    const CameraModel& camera = scene.camera;
    const double u = pixel % camera.width + rng.uniform(), v = pixel / camera.width + rng.uniform();
    return camera.direction(u, v);
  }
  /// Starts `camera_path` with the camera.
  void start_at_camera(Path& camera_path) const {
    SurfacePoint eye;
    eye.p = scene.camera.position;
    camera_path.start(eye, 0);
  }
  /// Starts `path` with the camera and the surface point seen through a random point of the pixel.
  bool start_camera_path(int pixel, Rng& rng) {
    start_at_camera(path);
    const auto point = trace_camera(direction_through(pixel, rng));
    if (point) path.push(scene, *point);
    return point.has_value();
  }

  /// Whether the path, the last vertex on an emitter, matters to the sink.
  bool matters(const Path& p) const {
    if constexpr (Sink::kDifferential) return can_move(scene, p, p.size() - 1, p.back().triangle);
    return true;
  }

  /// Hands the complete path p (last vertex on an emitter) to the sink.
  void emit(const Path& p, int pixel, const Rgb& value, double length, GateWeights use) {
    note_path(sink, p);
    if constexpr (Sink::kDifferential) {
      differentiate_path(scene, p.vertex.data(), p.size(), false, differential);
      if (differential.empty()) return;
      sink.bind(differential);
      sink.add(pixel, value, length, use);
    } else {
      sink.add(pixel, value * use.value, length);
    }
  }
};

struct Turn {
  Vec3 direction;  ///< unit
  double pdf;      ///< per solid angle
};

/// How a walk goes on from x, which looks back along the unit vector w_back, by BSDF sampling. Empty where it ends.
inline std::optional<Turn> turn(const PreparedScene& scene, const SurfacePoint& x, const Vec3& w_back, Rgb& throughput,
                                Rng& rng, Walk walk = Walk::towards_light) {
  const Material& material = scene.material_of(x.triangle);
  const double u0 = rng.uniform(), u1 = rng.uniform();
  const double u2 = material.type == MaterialType::rough_dielectric ? rng.uniform() : 0;
  const auto next = sample_direction(material, x.n, w_back, u0, u1, u2, walk);
  if (!next) return std::nullopt;
  throughput *= material.albedo * next->weight;
  if (throughput.is_black()) return std::nullopt;
  return Turn{next->direction, next->pdf};
}

struct Step {
  SurfacePoint point;
  Vec3 direction;  ///< unit, from the vertex before to the point
  double pdf;      ///< per solid angle
};

/// The same with the point that the walk arrives at.
template <class W>
std::optional<Step> step(W& worker, const SurfacePoint& x, const Vec3& w_back, Rgb& throughput, Rng& rng,
                         Walk walk = Walk::towards_light) {
  const auto next = turn(worker.scene, x, w_back, throughput, rng, walk);
  if (!next) return std::nullopt;
  const auto hit = worker.trace(x, next->direction);
  if (!hit) return std::nullopt;
  return Step{*hit, next->direction, next->pdf};
}

/// The same from the last vertex of a path, which grows by the new point.
template <class W>
bool extend(W& worker, Path& path, Rgb& throughput, Rng& rng) {
  const SurfacePoint x = path.back();
  const auto next = step(worker, x, normalize(path.vertex[path.size() - 2].p - x.p), throughput, rng);
  if (next) path.push(worker.scene, next->point);
  return next.has_value();
}

/// Counts towards Russian roulette from this bounce on.
inline constexpr int kRouletteBounce = 3;

/// Russian roulette on `throughput`, which started at one: true to go on, with the throughput raised accordingly.
inline bool survives(Rgb& throughput, int bounce, Rng& rng) {
  if (bounce < kRouletteBounce) return true;
  const double survival = std::min(throughput.max(), 0.95);
  if (!(rng.uniform() < survival)) return false;
  throughput *= 1 / survival;
  return true;
}

}  // namespace isochron
