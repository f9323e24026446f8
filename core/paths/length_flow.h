// How the emitter's point of a path moves so that the path keeps its length (theory section 7): the derivative then never acts
// on the gate.
#pragma once
#include "core/paths/path.h"

namespace isochron {

/// Of the last segment of a path, from q to the emitter's point y: when the flow of section 2 changes the length by dl, y also moves by
/// -X dl, in its plane and away from the foot of q there.
struct LengthFlow {
  Vec3 x;         ///< X: the length grows by one along it. Infinite where y is the foot itself
  Vec3 turn;      ///< how the gradient of the length at y changes along X
  double spread;  ///< divergence of X

  /// y is on an emitter with an extent, in a scene without glass.
  LengthFlow(const SurfacePoint& q, const SurfacePoint& y) {
    const Vec3 d = y.p - q.p;
    const double distance = length(d);
    const Vec3 u = d / distance, along = u - y.n * dot(u, y.n);
    x = along / length_squared(along);
    turn = (x - u) / distance;
    spread = 1 / distance;
  }
};

}  // namespace isochron
