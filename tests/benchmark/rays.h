// The renderer's own rays, recorded, and Embree's bare speed on them.
#pragma once
#include <embree3/rtcore.h>

#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "core/techniques/standard_walk.h"

namespace isochron::benchmarks {

/// One ray in Embree's precision. `far` is infinite where the first triangle is asked for, and 1 where it is
/// asked whether anything lies between the ray's ends.
struct RecordedRay {
  float origin[3], direction[3], far;
  bool occlusion() const { return far == 1.0f; }
};

/// Takes nothing.
class NoSink final : public Sink {
 public:
  bool differential() const override { return false; }
  void add(int, const Rgb&, double, GateUse) override {}
};

/// Keeps the rays of standard walks along a path.
class RayRecorder {
 public:
  RayRecorder(const PreparedScene& scene, const Path& path) : scene_(scene), path_(path) {}

  void closest_hit(const Vec3& from, const Vec3& direction) {
    record(from, direction, std::numeric_limits<float>::infinity());
  }
  /// From the path's last vertex.
  void closest_hit(const Vec3& direction) { closest_hit(scene_.offset_ray_origin(path_.back(), direction), direction); }
  /// Between the path's last two vertices.
  void occlusion() {
    const SurfacePoint &x = path_.vertex[path_.size() - 2], &y = path_.back();
    const Vec3 d = y.p - x.p, from = scene_.offset_ray_origin(x, d);
    record(from, scene_.offset_ray_origin(y, -d) - from, 1.0f);
  }
  std::vector<RecordedRay> rays;

 private:
  void record(const Vec3& from, const Vec3& d, float far) {
    RecordedRay ray{.origin = {}, .direction = {}, .far = far};
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = static_cast<float>(from[axis]);
      ray.direction[axis] = static_cast<float>(d[axis]);
    }
    rays.push_back(ray);
  }

  const PreparedScene& scene_;
  const Path& path_;
};

/// The rays of `samples` standard samples of every pixel, in the order of a rendering.
inline std::vector<RecordedRay> record_rays(const PreparedScene& scene, const GateSet& gates, int max_bounces,
                                            int samples) {
  const GatePick every_gate(gates);
  const EstimatorOptions options{.max_bounces = max_bounces};
  NoSink sink;
  Worker worker(scene, gates, options, every_gate, sink);
  Path path(max_bounces);
  RayRecorder recorder(scene, path);
  bool next_event = false;
  // The walk asks what it visits: in next-event estimation, before it traces the ray to the emitter.
  struct Visitor {
    RayRecorder& recorder;
    const bool& next_event;
    bool wants() const {
      if (next_event) recorder.occlusion();
      return true;
    }
    void take(const Rgb&) const {}
  };
  for (int i = 0; i < scene.camera.pixels() * samples; ++i) {
    const int pixel = i / samples;
    Rng rng(Stream{.seed = 3}, static_cast<std::uint64_t>(pixel), static_cast<std::uint32_t>(i % samples));
    const Vec3 direction = worker.direction_through(pixel, rng);
    recorder.closest_hit(scene.camera.position, direction);
    const auto hit = worker.trace_camera(direction);
    if (!hit) continue;
    worker.start_at_sensor(path, 0);
    path.push(scene, *hit);
    StandardWalk<Visitor> walk(worker, path, 0, max_bounces, {gates.lower(), gates.upper()}, {recorder, next_event});
    walk.begin(rng);
    for (bool goes_on = max_bounces > 0; goes_on;) {
      const std::size_t recorded = recorder.rays.size();
      const long long traced = worker.counts.rays;
      next_event = true;
      goes_on = walk.next_event_and_sample(rng);
      next_event = false;
      const auto occlusions = static_cast<long long>(recorder.rays.size() - recorded);
      if (worker.counts.rays - traced > occlusions) recorder.closest_hit(walk.direction());
      goes_on = goes_on && walk.intersect(rng);
    }
  }
  return std::move(recorder.rays);
}

/// Hands the rays to Embree one by one; returns how many hit something.
inline long long trace_bare(RTCScene scene, std::span<const RecordedRay> rays) {
  long long hits = 0;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  for (const RecordedRay& r : rays) {
    RTCRayHit query;
    query.ray = {.org_x = r.origin[0],
                 .org_y = r.origin[1],
                 .org_z = r.origin[2],
                 .tnear = 0,
                 .dir_x = r.direction[0],
                 .dir_y = r.direction[1],
                 .dir_z = r.direction[2],
                 .time = 0,
                 .tfar = r.far,
                 .mask = ~0u,
                 .id = 0,
                 .flags = 0};
    if (r.occlusion()) {
      rtcOccluded1(scene, &context, &query.ray);
      hits += query.ray.tfar < 0;
    } else {
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene, &context, &query);
      hits += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
  }
  return hits;
}

}  // namespace isochron::benchmarks
