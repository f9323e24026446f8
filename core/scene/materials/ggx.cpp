#include "core/scene/materials/ggx.h"

#include "core/base/sincos_2pi.h"
#include "core/scene/materials/bsdf.h"

namespace isochron::ggx {

ReflectionDerivative differentiate_reflection(double alpha, double cos_i, double cos_o, double cos_io) {
  const double a2 = alpha * alpha, b2 = (1 - alpha) * (1 + alpha);
  const Density d(a2, cos_i, cos_o, cos_io);
  if (d.value == 0) return {};
  const double root_i = smith_root(a2, cos_i), root_o = smith_root(a2, cos_o);
  const double ratio_i = cos_i / root_i, ratio_o = cos_o / root_o;
  const double inv_shadowing = 1 / (cos_o * root_i + cos_i * root_o);
  const double inv_t = 1 / d.t;

  // ln f = 2 ln(alpha q / t) - ln(shadowing) + const, with t = q - (1 - alpha^2) p^2.
  const double ln_d_by_p = 4 * b2 * d.p * inv_t;
  ReflectionDerivative result;
  result.value = d.value * 0.5 * inv_shadowing;
  result.by_cos_i = ln_d_by_p - (root_o + b2 * cos_o * ratio_i) * inv_shadowing;
  result.by_cos_o = ln_d_by_p - (root_i + b2 * cos_i * ratio_o) * inv_shadowing;
  result.by_cos_io = -ln_d_by_p * d.p / d.q;
  const double shadowing_by_alpha =
      alpha * (cos_o * (1 - cos_i) * (1 + cos_i) / root_i + cos_i * (1 - cos_o) * (1 + cos_o) / root_o);
  result.by_alpha = 2 * (d.excess - a2 * d.p * d.p) * inv_t / alpha - shadowing_by_alpha * inv_shadowing;
  return result;
}

Vec3 sample_visible_normal(double alpha, const Vec3& n, const Vec3& given, double u0, double u1) {
  const Frame frame(n);
  const Vec3 local = frame.to_local(given);
  // Stretched to the unit hemisphere, reflections by visible normals are uniform on the cap z > -v.z.
  const Vec3 v = normalize(Vec3{alpha * local.x, alpha * local.y, local.z});
  const SineCosine phi = sincos_2pi(u0);
  const double z = (1 - u1) * (1 + v.z) - v.z;
  const double r = std::sqrt(std::max((1 - z) * (1 + z), 0.0));
  const Vec3 h{r * phi.cosine + v.x, r * phi.sine + v.y, z + v.z};
  return frame.to_world(normalize(Vec3{alpha * h.x, alpha * h.y, h.z}));
}

}  // namespace isochron::ggx
