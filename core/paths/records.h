// What paths ask of a scene, side by side in memory.
#pragma once
#include <array>
#include <cstdint>

#include "core/base/vec.h"
#include "core/scene/emitters/area.h"
#include "core/scene/materials/bsdf.h"

namespace isochron {

/// A point on a triangle, or an end of a path that lies on none: the camera or the sensor point of a capture (triangle -1), or a
/// light without an extent.
struct SurfacePoint {
  Vec3 p;
  Vec3 n;  ///< unit face normal; that of the wall where a capture has its points; zero of camera and lights
  int triangle = -1;
};

/// The part of a gradient, with respect to the point, along its face.
inline Vec3 in_plane(const SurfacePoint& x, const Vec3& gradient) {
  return gradient - x.n * dot(gradient, x.n);
}

/// Encodes point light i as a negative triangle index of a SurfacePoint; light_number decodes it.
inline int index_of_light(int i) {
  return -2 - i;
}
inline bool is_light(int triangle) {
  return triangle < -1;
}
inline int light_number(int triangle) {
  return -2 - triangle;
}

/// What paths ask of a triangle, side by side in memory: two cache lines, the first of which decides where a ray ends and how
/// it continues. On a fine mesh each costs an access to main memory.
struct alignas(64) TriangleRecord {
  Vec3 normal;  ///< unit; zero when the triangle has no area
  Vec3 origin;  ///< corner 0
  double area = 0;
  int shape = -1;
  bool emits = false;
  bool has_gradient = false;        ///< a path through the triangle can have a derivative
  std::uint8_t moving_corners = 0;  ///< bit i: corner i is a vertex that moves
  Vec3 edge[2];                     ///< corners 1 and 2 from corner 0
  std::array<int, 3> vertex = {};
  std::uint8_t emitter_borders =
      0;  ///< bit i: the edge from corner i to the next ends the emitter's surface, or bends it
};
static_assert(sizeof(TriangleRecord) == 128);

/// What paths ask of a shape.
struct ShapeRecord {
  const Bsdf* bsdf = nullptr;
  int material = -1;
  bool two_sided = false;
  double index = 0;  ///< of refraction behind its faces; 0: opaque
  AreaEmitter emission;
  bool textured = false;
  double emitter_pdf = 0;  ///< per area, of the points of sample_emitter()
};

}  // namespace isochron
