// The scratch state of one partition of the work, the vertices that paths are built of, and how complete paths reach the
// sink. What takes random numbers on every bounce is inline, so that their state stays in registers.
#pragma once
#include <algorithm>
#include <array>
#include <optional>
#include <vector>

#include "core/base/random.h"
#include "core/films/sinks.h"
#include "core/paths/options.h"
#include "core/techniques/balance.h"

namespace isochron {

/// The state of one partition; not shared between threads. What it refers to must outlive it.
struct Worker {
  const PreparedScene& scene;
  const GateSet& gates;
  const EstimatorOptions& options;
  const GatePick& pick;
  Balance balance;
  Sink& sink;
  const bool differential_sink;  ///< sink.differential()
  const AreaSteps area_steps;
  Path path;
  LocalDifferential differential, of_length;
  std::vector<int> candidates;              ///< triangles that may hold an arc
  std::vector<double> inverse_probability;  ///< of each candidate: 1 / probability that it is listed
  WorkCounts counts;                        ///< arcs: with the queries that found their triangles

  Worker(const PreparedScene& prepared, const GateSet& gate_set, const EstimatorOptions& estimator,
         const GatePick& gate_pick, Sink& target);

  std::array<WorkCounts, kTechniques> work_of{};  ///< that of the samples of Passes::visit

  // Queries of the scene, whose rays are counted.
  bool visible(const SurfacePoint& x, const SurfacePoint& y) {
    ++counts.rays;
    return scene.visible(x, y);
  }
  int closest_hit(const SurfacePoint& x, const Vec3& w) {
    ++counts.rays;
    return scene.closest_hit(x, w);
  }
  int closest_hit_within(const SurfacePoint& x, const Vec3& w, double distance) {
    ++counts.rays;
    return scene.closest_hit_within(x, w, distance);
  }
  int closest_camera_hit(const Vec3& direction) {
    ++counts.rays;
    return scene.closest_camera_hit(direction);
  }
  std::optional<SurfacePoint> trace(const SurfacePoint& x, const Vec3& w) {
    return scene.end_point(closest_hit(x, w), x.p, w);
  }
  std::optional<SurfacePoint> trace_camera(const Vec3& direction) {
    return scene.end_point(closest_camera_hit(direction), scene.camera.position, direction);
  }

  /// Of a ray from the camera through a random point of the pixel; unit.
  Vec3 direction_through(int pixel, Rng& rng) const {
    const CameraModel& camera = scene.camera;
    const double u = pixel % camera.width + rng.uniform(), v = pixel / camera.width + rng.uniform();
    return camera.direction(u, v);
  }
  /// Starts `sensor_path` with what a pixel looks from: the camera, or the sensor point of a capture.
  void start_at_sensor(Path& sensor_path, int pixel) const;
  /// Starts `path` with that and a surface point x1 that it sees: of a camera through a random point of the pixel, of a capture
  /// by the reflection of the wall or by area sampling, whichever has the larger density there (maximum heuristic). Returns what
  /// the pixel makes of radiance from x1, over density; 0: there is no x1. `hidden`: probability of area sampling.
  double start_path(int pixel, Rng& rng, double hidden);
  double start_path(int pixel, Rng& rng) { return start_path(pixel, rng, area_steps.first); }

  /// Whether the complete path p (last vertex on an emitter) contributes: to images always, to derivatives where it can
  /// have a gradient.
  bool contributes(const Path& p) const {
    return !differential_sink || path_has_gradient(scene, p, p.size() - 1, p.back().triangle);
  }

  /// Hands the complete path p to the sink.
  void emit(const Path& p, int pixel, const Rgb& value, double length, GateUse use);
  /// Passes only the change of its length to the sink, for one gate: a member of a coupled pair.
  void emit_length_rate(const Path& p, int pixel, int gate, const Rgb& value);
  /// Passes value x the change of its length x the gates' values to the sink: what a flow that keeps the length carries across
  /// the end of the paths of equal length.
  void emit_length_flux(const Path& p, int pixel, const Rgb& value, double length);

 private:
  /// Of the path p, or of its length alone.
  void differentiate(const Path& p, int pixel, bool length_only, LocalDifferential& out);
  double start_at_wall(int pixel, Rng& rng, double hidden);
};

struct BsdfSample {
  Vec3 direction;  ///< unit
  double pdf;      ///< per solid angle
};

/// Of the surface at x, in 1/sr.
inline Rgb bsdf_value(const PreparedScene& scene, const SurfacePoint& x, const Directions& d) {
  const Rgb f = scene.bsdf_of(x.triangle).value(d);
  return scene.textured(x.triangle) ? f * scene.texture(x) : f;
}

/// Samples the direction in which a path continues from x, reached from the direction of the unit vector w_back. `throughput` gets
/// the BSDF's weight. Empty where the path ends.
inline std::optional<BsdfSample> sample_bsdf(const PreparedScene& scene, const SurfacePoint& x, const Vec3& w_back,
                                             Rgb& throughput, Rng& rng, TransportMode mode = TransportMode::radiance) {
  const Bsdf& bsdf = scene.bsdf_of(x.triangle);
  const double u0 = rng.uniform(), u1 = rng.uniform();
  const double u2 = bsdf.dimensions() == 3 ? rng.uniform() : 0;
  const auto next = bsdf.sample(x.n, w_back, u0, u1, u2, mode);
  if (!next) return std::nullopt;
  throughput *= next->weight;
  if (scene.textured(x.triangle)) throughput *= scene.texture(x);
  if (throughput.is_black()) return std::nullopt;
  return BsdfSample{next->direction, next->pdf};
}

struct NextVertex {
  SurfacePoint point;
  Vec3 direction;  ///< unit, from the vertex before to the point
  double pdf;      ///< per solid angle
};

/// `sample_bsdf` and the surface point that the direction leads to.
std::optional<NextVertex> trace_next_vertex(Worker& worker, const SurfacePoint& x, const Vec3& w_back, Rgb& throughput,
                                            Rng& rng, TransportMode mode = TransportMode::radiance);

/// `trace_next_vertex` from the last vertex of a path, which grows by the new point. False where the path ends.
bool append_vertex(Worker& worker, Path& path, Rgb& throughput, Rng& rng);

/// Russian roulette takes place from this bounce on.
inline constexpr int kRouletteBounce = 3;

/// Russian roulette on `throughput`, which started at one: true to go on, with the throughput raised accordingly.
inline bool russian_roulette(Rgb& throughput, int bounce, Rng& rng) {
  if (bounce < kRouletteBounce) return true;
  const double survival = std::min(throughput.max(), 0.95);
  if (!(rng.uniform() < survival)) return false;
  throughput *= 1 / survival;
  return true;
}

}  // namespace isochron
