// Rays against the scene's triangles. Embree finds the triangle in single precision; the hit is then recomputed in
// double precision from the triangle's plane, because path lengths must not lose digits.
#pragma once
#include <embree3/rtcore.h>

#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "core/scene/scene.h"

namespace isochron {

/// How the hierarchy of boxes follows the scene when vertices move.
enum class CasterUpdate {
  rebuild,  ///< the fastest rays
  refit  ///< boxes of shapes that moved are adapted in a thirtieth of the time, others stay; rays take a tenth longer
};

/// RayCaster::offset of the scene.
double ray_offset(const Scene& scene);

class RayCaster {
 public:
  /// Throws std::runtime_error where Embree cannot make its hierarchy, as does `update`: there is too little memory.
  explicit RayCaster(const Scene& scene, CasterUpdate update = CasterUpdate::rebuild);
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// Index of the first triangle along (origin, direction) up to `far` lengths of `direction`, or -1.
  int closest_hit(const Vec3& origin, const Vec3& direction, float far = std::numeric_limits<float>::infinity()) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRayHit query;
    set_ray(query.ray, origin, direction, far);
    query.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    rtcIntersect1(scene_.get(), &context, &query);
    return query.hit.geomID == RTC_INVALID_GEOMETRY_ID ? -1
                                                       : first_[query.hit.geomID] + static_cast<int>(query.hit.primID);
  }
  /// True when anything lies between the two points.
  bool occluded(const Vec3& from, const Vec3& to) const {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    RTCRay ray;
    set_ray(ray, from, to - from, 1.0f);
    rtcOccluded1(scene_.get(), &context, &ray);
    return ray.tfar < 0;
  }

  /// Vertices have moved, those of the marked shapes; topology is that of the initial scene. Results do not depend on earlier
  /// updates.
  void update(const Scene& scene, const std::vector<char>& moved_shapes);

  /// How far a ray's start is moved off the surface it leaves, so that rounding to single precision does not put it
  /// behind that surface: a few rounding steps of the scene's largest coordinate.
  double offset() const { return offset_; }

  /// The committed Embree scene.
  RTCScene embree_scene() const { return scene_.get(); }

 private:
  using Float4 [[gnu::vector_size(16)]] = float;

  /// Embree reads a ray in vectors of four, which would have to wait for the parts if these were stored one by one.
  static void set_ray(RTCRay& ray, const Vec3& origin, const Vec3& direction, float far) {
    const Float4 from{static_cast<float>(origin.x), static_cast<float>(origin.y), static_cast<float>(origin.z), 0};
    const Float4 along{static_cast<float>(direction.x), static_cast<float>(direction.y),
                       static_cast<float>(direction.z), 0};
    std::memcpy(&ray.org_x, &from, sizeof from);    // and tnear = 0
    std::memcpy(&ray.dir_x, &along, sizeof along);  // and time = 0
    ray.tfar = far;
    ray.mask = ~0u;
    ray.flags = 0;
  }

  void build(const Scene& scene);
  void commit();
  void attach(const Scene& scene, int first_vertex, int vertices, int first_triangle, int triangles);
  void fill_vertices(const Scene& scene, unsigned geometry, int first_vertex, int vertices) const;

  const CasterUpdate update_;
  struct Release {
    void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
  };
  std::unique_ptr<RTCSceneTy, Release> scene_;
  std::vector<int> first_;  ///< triangle of each of Embree's geometries: one for all, or one per shape
  double offset_ = 0;
};

}  // namespace isochron
