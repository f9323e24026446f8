// Microfacets of the GGX law with Smith's masking: what the rough materials share.
#pragma once
#include <algorithm>
#include <cmath>

#include "core/base/constants.h"
#include "core/base/vec.h"

namespace isochron::ggx {

/// sqrt(cos^2 + alpha^2 sin^2): one plus Smith's Lambda is (1 + this / cos) / 2.
inline double smith_root(double alpha_squared, double cosine) {
  return std::sqrt(cosine * cosine + alpha_squared * (1 - cosine) * (1 + cosine));
}

/// Density of the half vector h, in 1/sr. With p = cos_i + cos_o and q = |w_i + w_o|^2 the squared cosine
/// of h is p^2 / q; written in p and q, sin^2 = (q - p^2) / q keeps its accuracy next to the mirror
/// direction.
struct Density {
  Density(double alpha_squared, double cos_i, double cos_o, double cos_io)
      : p(cos_i + cos_o),
        q(2 + 2 * cos_io),
        excess(std::max(q - p * p, 0.0)),  // round-off may take it below zero
        t(alpha_squared * p * p + excess),
        value(q > 0 ? alpha_squared * kInvPi * (q / t) * (q / t) : 0) {}

  double p, q, excess, t, value;
};

/// Reflection by perfect mirrors, in 1/sr: D G2 / (4 cos_i cos_o), single scattering with height-correlated
/// masking-shadowing (Heitz 2014). Cosines of the directions are positive.
inline double reflection(double alpha, double cos_i, double cos_o, double cos_io) {
  const double a2 = alpha * alpha;
  // G2 / (4 cos_i cos_o) = 1 / (2 (cos_o root_i + cos_i root_o)): no division by a grazing cosine.
  const double shadowing = cos_o * smith_root(a2, cos_i) + cos_i * smith_root(a2, cos_o);
  return Density(a2, cos_i, cos_o, cos_io).value / (2 * shadowing);
}

/// ln(reflection) differentiated by its arguments, the cosines as if they were independent; the value alongside. Where that
/// is 0, all are.
struct ReflectionDerivative {
  double value = 0, by_cos_i = 0, by_cos_o = 0, by_cos_io = 0, by_alpha = 0;
};
ReflectionDerivative differentiate_reflection(double alpha, double cos_i, double cos_o, double cos_io);

/// Density per solid angle of mirroring w_o by a visible normal: D G1(w_o) / (4 cos_o), G1 = 2 cos_o / (cos_o + root_o).
inline double reflection_pdf(double alpha, double cos_i, double cos_o, double cos_io) {
  const double a2 = alpha * alpha;
  return Density(a2, cos_i, cos_o, cos_io).value / (2 * (cos_o + smith_root(a2, cos_o)));
}

/// reflection * cos_i / reflection_pdf = G2 / G1(w_o): the half vector's density cancels.
inline double reflection_weight(double alpha, double cos_i, double cos_o) {
  const double a2 = alpha * alpha, root_i = smith_root(a2, cos_i), root_o = smith_root(a2, cos_o);
  return cos_i * (cos_o + root_o) / (cos_o * root_i + cos_i * root_o);
}

/// A microfacet's unit normal, visible from `given`, which is on the side of the surface's normal n, with the density of the
/// visible normals (Heitz 2018, by the spherical caps of Dupuy and Benyoub 2023).
Vec3 sample_visible_normal(double alpha, const Vec3& n, const Vec3& given, double u0, double u1);

}  // namespace isochron::ggx
