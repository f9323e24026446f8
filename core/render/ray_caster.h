// Rays against the scene's triangles. Embree finds the triangle in single precision; the hit is then recomputed in
// double precision from the triangle's plane, because path lengths must not lose digits.
#pragma once
#include <embree3/rtcore.h>

#include <memory>
#include <vector>

#include "core/scene/scene.h"

namespace isochron {

class RayCaster {
 public:
  explicit RayCaster(const Scene& scene);
  ~RayCaster();
  RayCaster(const RayCaster&) = delete;
  RayCaster& operator=(const RayCaster&) = delete;

  /// Index of the first triangle along (origin, direction), or -1.
  int first_triangle(const Vec3& origin, const Vec3& direction) const;
  /// True when anything lies between the two points.
  bool occluded(const Vec3& from, const Vec3& to) const;

  /// How far a ray's start is moved off the surface it leaves, so that rounding to single precision does not put it
  /// behind that surface: a few rounding steps of the scene's largest coordinate.
  double offset() const { return offset_; }

 private:
  RTCScene scene_ = nullptr;
  double offset_ = 0;
};

}  // namespace isochron
