// How x1, the surface point that the camera sees, flows when the scene moves.
//
// Theory section 2 keeps x1 on its pixel ray. Then its distance to a close x2 that moves changes at a rate
// that does not fall with the distance, and the derivative of the geometry term between them grows like one
// over it: infinite variance in corners of moving objects, in moving glass and where moving objects touch
// others. So x1 follows x2 where they are close: its velocity is
//     pixel flow + w(x1, x2) P (velocity of x2 - pixel flow),    w = (1 - (|x1 - x2| / s)^2)^2 within s, else
//     0,
// with P the projection into the plane of x1 and s the follow radius, a few pixels' width at the depth of x1.
// Any w gives the same derivative: what leaves the interior term passes through the borders of the pixel and
// along the edges that the camera sees, as part of the visibility term (paper Eq. 9: only the flow across a
// boundary counts).
#pragma once
#include <vector>

#include "core/geometry/bounds.h"
#include "core/render/camera_model.h"
#include "core/scene/scene.h"

namespace isochron {

struct LocalDifferential;
struct MovingParts;
struct SurfacePoint;
class PreparedScene;

class CameraFlow {
 public:
  /// `radius`: s in widths of a pixel; 0: x1 stays on its pixel ray.
  CameraFlow(const Scene& scene, const CameraModel& camera, const MovingParts& moving, double radius);

  struct Follow {
    double weight = 0;  ///< w
    Vec3 gradient;      ///< of w with respect to x1
  };
  Follow follow(const Vec3& x1, const Vec3& x2) const;
  /// s at x1: it does not follow what is farther off.
  double radius_at(const Vec3& x1) const { return radius_ * dot(forward_, x1 - position_); }

  /// Whether there may be points x1 and x2, one of which moves, close enough for x1 to follow.
  bool possible() const { return possible_; }
  /// The same for x1 on the ray from the camera along d, or at x1.
  bool possible_along(const Vec3& d) const { return possible_ && near_.meets_ray(position_, d); }
  bool possible_at(const Vec3& x1) const { return possible_ && near_.holds(x1); }

 private:
  Vec3 position_, forward_;  ///< of the camera
  double radius_;            ///< s per depth
  Bounds near_;              ///< holds every x1 that may follow
  bool possible_ = false;
};

/// Adds g . (velocity of x1 along its pixel ray) to `out`.
void add_pixel_flow(const PreparedScene& scene, const SurfacePoint& x1, const Vec3& g, LocalDifferential& out);

/// Adds g . (velocity of x1 - pixel flow), which is w P (velocity of x2 - pixel flow), to `out`.
void add_following_flow(const PreparedScene& scene, const SurfacePoint& x1, const SurfacePoint& x2, const Vec3& g,
                        LocalDifferential& out);

}  // namespace isochron
