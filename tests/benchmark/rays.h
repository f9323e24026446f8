// The renderer's own rays, recorded, and Embree's bare speed on them.
#pragma once
#include <embree3/rtcore.h>

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "core/techniques/standard_walk.h"

namespace isochron::benchmarks {

/// One ray in Embree's precision. `far` is infinite where the first triangle is asked for, and 1 where it is
/// asked whether anything lies between the ray's ends.
struct RecordedRay {
  float origin[3], direction[3], far;
  bool occlusion() const { return far == 1.0f; }
};

/// Stands in for the renderer's Worker and keeps every ray that a standard walk traces.
struct RayRecorder {
  const PreparedScene& scene;
  std::vector<RecordedRay> rays;

  void record(const Vec3& from, const Vec3& d, float far) {
    RecordedRay ray{.origin = {}, .direction = {}, .far = far};
    for (int axis = 0; axis < 3; ++axis) {
      ray.origin[axis] = static_cast<float>(from[axis]);
      ray.direction[axis] = static_cast<float>(d[axis]);
    }
    rays.push_back(ray);
  }
  bool visible(const SurfacePoint& x, const SurfacePoint& y) {
    const Vec3 d = y.p - x.p, from = scene.leave(x, d);
    record(from, scene.leave(y, -d) - from, 1.0f);
    return scene.visible(x, y);
  }
  int cast(const SurfacePoint& x, const Vec3& w) {
    record(scene.leave(x, w), w, std::numeric_limits<float>::infinity());
    return scene.cast(x, w);
  }
};

/// The rays of `samples` standard samples of every pixel, in the order of a rendering.
inline std::vector<RecordedRay> record_rays(const PreparedScene& scene, const GateSet& gates, int max_bounces,
                                            int samples) {
  struct Visitor {
    bool wants() const { return true; }
    void take(const Rgb&) const {}
  };
  RayRecorder recorder{scene, {}};
  Path path(max_bounces);
  for (int i = 0; i < scene.camera.pixels() * samples; ++i) {
    const int pixel = i / samples;
    Rng rng(Stream{.seed = 3}, static_cast<std::uint64_t>(pixel), static_cast<std::uint32_t>(i % samples));
    const double u = pixel % scene.camera.width + rng.uniform(), v = pixel / scene.camera.width + rng.uniform();
    const Vec3 direction = scene.camera.direction(u, v);
    recorder.record(scene.camera.position, direction, std::numeric_limits<float>::infinity());
    const auto hit = scene.trace_camera(direction);
    if (!hit) continue;
    SurfacePoint eye;
    eye.p = scene.camera.position;
    path.start(eye, 0);
    path.push(scene, *hit);
    walk_standard(recorder, path, max_bounces, {gates.lower(), gates.upper()}, rng, Visitor{});
  }
  return recorder.rays;
}

/// Hands the rays to Embree one by one; returns how many met something.
inline long long trace_bare(RTCScene scene, std::span<const RecordedRay> rays) {
  long long met = 0;
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
      met += query.ray.tfar < 0;
    } else {
      query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
      query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
      rtcIntersect1(scene, &context, &query);
      met += query.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
  }
  return met;
}

}  // namespace isochron::benchmarks
