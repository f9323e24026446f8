// Shadows of edges on the planes of emitters.
#pragma once
#include <cmath>

#include "core/paths/prepared_scene.h"
#include "core/techniques/boundary_edges.h"

namespace isochron {

/// Where the line from D through an edge meets an emitter's plane: D + p (height / -(n.p)), p = a + s c.
struct ShadowLine {
  Vec3 n, a, c;
  double height;  ///< of D above the plane
  ShadowLine(const PreparedScene& scene, const Vec3& d, const BoundaryEdge& edge, int emitter)
      : n(scene.normal(emitter)),
        a(edge.origin - d),
        c(edge.end - edge.origin),
        height(scene.height_over(emitter, d)) {}
  /// The edge lies between D and the plane.
  bool casts(double s) const {
    const double towards = -dot(n, a + c * s);
    return towards > 0 && towards < height;
  }
  /// |d (distance from D to the plane) / ds|
  double distance_rate(double s) const {
    const Vec3 p = a + c * s;
    const double towards = -dot(n, p), norm = length(p);
    return std::abs(height * (dot(p, c) / (norm * towards) + norm * dot(n, c) / (towards * towards)));
  }
};

}  // namespace isochron
