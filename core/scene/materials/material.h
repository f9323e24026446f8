// Scattering of a surface, as a function of three cosines only (all our lobes are isotropic): cos_i = n.w_i
// towards the light side, cos_o = n.w_o towards the camera side, cos_io = w_i.w_o. f = albedo * lobe.
//
// The rough conductor is a single-scattering GGX with Smith's height-correlated masking-shadowing (Heitz
// 2014) and a constant reflectance: lobe = D G2 / (4 cos_i cos_o).
//
// The rough dielectric is the boundary of a solid of index `ior`: the front of its faces is outside (index 1), the
// back inside. Cosines of equal sign mean reflection, of opposite sign refraction. It is the single-scattering GGX
// of Walter et al. 2007 with unpolarised Fresnel reflectance and separable masking-shadowing G1 G1. The lobe is that
// of radiance that travels from w_i to w_o: by refraction it changes with the square of the index of its medium.
// As in that model, the refracting lobe ends with a jump where the half vector lies in the surface, at alpha^4 of its
// peak; derivatives of the lobe leave out the motion of that jump.
#pragma once
#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "core/base/constants.h"
#include "core/base/vec.h"

namespace isochron {

enum class MaterialType { diffuse, rough_conductor, rough_dielectric };

struct Material {
  std::string name;
  MaterialType type = MaterialType::diffuse;
  Rgb albedo{0.5};         ///< diffuse albedo, or the conductor's reflectance; 1 for a dielectric
  double roughness = 0.2;  ///< GGX alpha
  double ior = 1.5;        ///< index of refraction behind a dielectric's face; above 0 and other than 1
  bool two_sided = false;  ///< reflects on both sides of the face
};

/// ln(lobe) differentiated by its arguments; the lobe's value alongside.
struct LobeDerivative {
  double value = 0;                                                ///< 1/sr
  double d_cos_i = 0, d_cos_o = 0, d_cos_io = 0, d_roughness = 0;  ///< of ln(value)
  double d_ior = 0;                                                ///< of ln(value)
};

/// What a path that is traced vertex by vertex transports, and so which of the two directions is drawn given the other.
enum class TransportMode {
  radiance,   ///< traced from the camera towards the light: w_i is drawn, w_o given
  importance  ///< traced towards the camera: w_o is drawn, w_i given
};

struct DirectionSample {
  Vec3 direction;  ///< unit, world space
  double pdf;      ///< per solid angle
  double weight;   ///< lobe * |cosine of the direction| / pdf
};

namespace detail {

/// sqrt(cos^2 + alpha^2 sin^2): one plus Smith's Lambda is (1 + this / cos) / 2.
inline double smith_root(double alpha_squared, double cosine) {
  return std::sqrt(cosine * cosine + alpha_squared * (1 - cosine) * (1 + cosine));
}

/// GGX density of the half vector h, in 1/sr. With p = cos_i + cos_o and q = |w_i + w_o|^2 the squared cosine
/// of h is p^2 / q; written in p and q, sin^2 = (q - p^2) / q keeps its accuracy next to the mirror
/// direction.
struct GgxDensity {
  GgxDensity(double alpha_squared, double cos_i, double cos_o, double cos_io)
      : p(cos_i + cos_o),
        q(2 + 2 * cos_io),
        excess(std::max(q - p * p, 0.0)),  // round-off may take it below zero
        t(alpha_squared * p * p + excess),
        value(q > 0 ? alpha_squared * kInvPi * (q / t) * (q / t) : 0) {}

  double p, q, excess, t, value;
};

/// Turns a pair of negative cosines of a two-sided material into positive ones. False: nothing is scattered.
inline bool face_forward(const Material& material, double& cos_i, double& cos_o) {
  if (material.two_sided && cos_o < 0) {
    cos_i = -cos_i;
    cos_o = -cos_o;
  }
  return cos_i > 0 && cos_o > 0;
}

// The rough dielectric's part of the functions below.
double dielectric_lobe(const Material& material, double cos_i, double cos_o, double cos_io);
LobeDerivative dielectric_lobe_derivative(const Material& material, double cos_i, double cos_o, double cos_io);
double dielectric_pdf(const Material& material, double cos_i, double cos_o, double cos_io);
/// Reflects or refracts the unit vector `given` at a microfacet with unit normal h on its side.
std::optional<DirectionSample> dielectric_sample(const Material& material, const Vec3& n, const Vec3& given,
                                                 const Vec3& h, double u, TransportMode mode);

}  // namespace detail

/// Lobe value in 1/sr, without cosine and albedo; zero where nothing is scattered (below the surface). For
/// `two_sided` materials a pair of negative cosines counts as a pair of positive ones.
inline double lobe(const Material& material, double cos_i, double cos_o, double cos_io) {
  if (material.type == MaterialType::rough_dielectric) return detail::dielectric_lobe(material, cos_i, cos_o, cos_io);
  if (!detail::face_forward(material, cos_i, cos_o)) return 0;
  if (material.type == MaterialType::diffuse) return kInvPi;
  const double a2 = material.roughness * material.roughness;
  // G2 / (4 cos_i cos_o) = 1 / (2 (cos_o root_i + cos_i root_o)): no division by a grazing cosine.
  const double shadowing = cos_o * detail::smith_root(a2, cos_i) + cos_i * detail::smith_root(a2, cos_o);
  return detail::GgxDensity(a2, cos_i, cos_o, cos_io).value / (2 * shadowing);
}

/// As `lobe`, with the derivatives of its logarithm. Where value is 0 the derivatives are 0. The three
/// cosines count as independent: the derivative of each is the formula's, continued off the set of cosines
/// that directions can have.
LobeDerivative lobe_derivative(const Material& material, double cos_i, double cos_o, double cos_io);

/// Density per solid angle with which `sample_direction` draws w_i given w_o. Integrates to less than one
/// where some draws end below the surface and are dropped. With cos_i and cos_o exchanged: the density of w_o given w_i.
inline double direction_pdf(const Material& material, double cos_i, double cos_o, double cos_io) {
  if (material.type == MaterialType::rough_dielectric) return detail::dielectric_pdf(material, cos_i, cos_o, cos_io);
  if (!detail::face_forward(material, cos_i, cos_o)) return 0;
  if (material.type == MaterialType::diffuse) return cos_i * kInvPi;
  // Visible normals: D G1(w_o) / (4 cos_o), G1 = 2 cos_o / (cos_o + root_o).
  const double a2 = material.roughness * material.roughness;
  return detail::GgxDensity(a2, cos_i, cos_o, cos_io).value / (2 * (cos_o + detail::smith_root(a2, cos_o)));
}

/// Draws one direction given the other (both point away from the surface with unit normal n): cosine-weighted for
/// diffuse, visible GGX normals (Heitz 2018, by the spherical caps of Dupuy and Benyoub 2023) for rough conductors and
/// dielectrics; a dielectric reflects or refracts, by `u2` and in proportion to Fresnel's reflectance. Empty when
/// nothing is scattered. A two-sided material seen from behind scatters to the side of the given direction.
std::optional<DirectionSample> sample_direction(const Material& material, const Vec3& n, const Vec3& given, double u0,
                                                double u1, double u2 = 0.5,
                                                TransportMode mode = TransportMode::radiance);

}  // namespace isochron
