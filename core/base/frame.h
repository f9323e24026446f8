// Frames about a direction, and directions drawn in them.
#pragma once
#include <cmath>

#include "core/base/sincos_2pi.h"
#include "core/base/vec.h"

namespace isochron {

/// Orthonormal frame whose third axis is n.
struct Frame {
  explicit Frame(const Vec3& normal) : n(normal) { complete_frame(n, s, t); }
  Vec3 to_world(const Vec3& v) const { return v.x * s + v.y * t + v.z * n; }
  Vec3 to_local(const Vec3& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3 n, s, t;
};

/// Cosine-weighted about n: density cos / pi.
inline Vec3 sample_cosine(const Vec3& n, double u0, double u1) {
  const double r = std::sqrt(u0);
  const SineCosine phi = sincos_2pi(u1);
  return Frame(n).to_world({r * phi.cosine, r * phi.sine, std::sqrt(1 - u0)});
}

}  // namespace isochron
