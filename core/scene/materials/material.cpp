#include "core/scene/materials/material.h"

#include "core/base/sincos_2pi.h"

namespace isochron {
namespace {

/// Orthonormal frame whose third axis is n.
struct Frame {
  explicit Frame(const Vec3& normal) : n(normal) { complete_frame(n, s, t); }
  Vec3 to_world(const Vec3& v) const { return v.x * s + v.y * t + v.z * n; }
  Vec3 to_local(const Vec3& v) const { return {dot(v, s), dot(v, t), dot(v, n)}; }
  Vec3 n, s, t;
};

/// A GGX normal visible from w_o (local frame, z up) with the density of the visible normals. Stretched to
/// the unit hemisphere, reflections of w_o by visible normals are uniform on the cap z > -w_o.z.
Vec3 sample_visible_normal(double alpha, const Vec3& w_o, double u0, double u1) {
  const Vec3 v = normalize(Vec3{alpha * w_o.x, alpha * w_o.y, w_o.z});
  const SineCosine phi = sincos_2pi(u0);
  const double z = (1 - u1) * (1 + v.z) - v.z;
  const double r = std::sqrt(std::max((1 - z) * (1 + z), 0.0));
  const Vec3 h{r * phi.cosine + v.x, r * phi.sine + v.y, z + v.z};
  return normalize(Vec3{alpha * h.x, alpha * h.y, h.z});
}

Vec3 sample_cosine(double u0, double u1) {
  const double r = std::sqrt(u0);
  const SineCosine phi = sincos_2pi(u1);
  return {r * phi.cosine, r * phi.sine, std::sqrt(1 - u0)};
}

}  // namespace

LobeDerivative lobe_derivative(const Material& material, double cos_i, double cos_o, double cos_io) {
  if (material.type == MaterialType::rough_dielectric)
    return detail::dielectric_lobe_derivative(material, cos_i, cos_o, cos_io);
  const double side = material.two_sided && cos_o < 0 ? -1 : 1;
  if (!detail::face_forward(material, cos_i, cos_o)) return {};
  if (material.type == MaterialType::diffuse) return {.value = kInvPi};

  const double alpha = material.roughness, a2 = alpha * alpha, b2 = (1 - alpha) * (1 + alpha);
  const detail::GgxDensity d(a2, cos_i, cos_o, cos_io);
  if (d.value == 0) return {};
  const double root_i = detail::smith_root(a2, cos_i), root_o = detail::smith_root(a2, cos_o);
  const double ratio_i = cos_i / root_i, ratio_o = cos_o / root_o;
  const double inv_shadowing = 1 / (cos_o * root_i + cos_i * root_o);
  const double inv_t = 1 / d.t;

  // ln lobe = 2 ln(alpha q / t) - ln(shadowing) + const, with t = q - (1 - alpha^2) p^2.
  const double ln_d_by_p = 4 * b2 * d.p * inv_t;
  LobeDerivative result;
  result.value = d.value * 0.5 * inv_shadowing;
  result.d_cos_i = side * (ln_d_by_p - (root_o + b2 * cos_o * ratio_i) * inv_shadowing);
  result.d_cos_o = side * (ln_d_by_p - (root_i + b2 * cos_i * ratio_o) * inv_shadowing);
  result.d_cos_io = -ln_d_by_p * d.p / d.q;
  const double shadowing_by_alpha =
      alpha * (cos_o * (1 - cos_i) * (1 + cos_i) / root_i + cos_i * (1 - cos_o) * (1 + cos_o) / root_o);
  result.d_roughness = 2 * (d.excess - a2 * d.p * d.p) * inv_t / alpha - shadowing_by_alpha * inv_shadowing;
  return result;
}

std::optional<DirectionSample> sample_direction(const Material& material, const Vec3& n, const Vec3& given, double u0,
                                                double u1, double u2, TransportMode mode) {
  const double facing = dot(n, given);
  const bool two_sided = material.two_sided || material.type == MaterialType::rough_dielectric;
  if (facing == 0 || (facing < 0 && !two_sided)) return std::nullopt;
  const Frame frame(facing < 0 ? -n : n);

  DirectionSample result{};
  if (material.type == MaterialType::diffuse) {
    result.direction = frame.to_world(sample_cosine(u0, u1));
  } else {
    const Vec3 h = frame.to_world(sample_visible_normal(material.roughness, frame.to_local(given), u0, u1));
    if (material.type == MaterialType::rough_dielectric)
      return detail::dielectric_sample(material, n, given, h, u2, mode);
    result.direction = 2 * dot(given, h) * h - given;
  }
  const double cos_i = dot(frame.n, result.direction), cos_o = std::abs(facing);
  if (!(cos_i > 0)) return std::nullopt;

  result.pdf = direction_pdf(material, dot(n, result.direction), facing, dot(given, result.direction));
  if (!(result.pdf > 0)) return std::nullopt;
  if (material.type == MaterialType::diffuse) {
    result.weight = 1;
  } else {  // G2 / G1(given): the half vector's density cancels
    const double a2 = material.roughness * material.roughness;
    const double root_i = detail::smith_root(a2, cos_i), root_o = detail::smith_root(a2, cos_o);
    result.weight = cos_i * (cos_o + root_o) / (cos_o * root_i + cos_i * root_o);
  }
  return result;
}

}  // namespace isochron
