// The rough dielectric (Walter et al. 2007), written in the three cosines so that nothing cancels near normal
// incidence, near grazing, near the critical angle or for indices close to one.
#include "core/scene/materials/material.h"

namespace isochron::detail {
namespace {

double square(double x) {
  return x * x;
}

/// Fresnel's reflectance of a smooth face between the side `front` of a dielectric and the other, unpolarised.
struct Fresnel {
  double m2;        ///< squared index of the far side relative to the near one
  double contrast;  ///< m2 - 1
  double m2_by_ior;

  Fresnel(double ior, bool front)
      : m2(front ? ior * ior : 1 / (ior * ior)),
        contrast((ior - 1) * (ior + 1) * (front ? 1 : -m2)),
        m2_by_ior(front ? 2 * ior : -2 * m2 / ior) {}

  /// Relative index times the cosine of refraction; 0 under total reflection. x: cosine of incidence.
  double refracted(double x) const { return std::sqrt(std::max(contrast + x * x, 0.0)); }
  double reflectance(double x) const {
    const double g = refracted(x);
    return g > 0 ? 0.5 * (square(across(x, g)) + square(along(x, g))) : 1;
  }
  /// Derivatives of ln(reflectance); they grow without bound, but integrably, towards the critical angle.
  void differentiate(double x, double& by_cosine, double& by_ior) const {
    by_cosine = by_ior = 0;
    const double g = refracted(x);
    if (!(g > 0)) return;
    const double s = across(x, g), p = along(x, g), scale = 2 / (g * (s * s + p * p));
    const double sum2 = square(x + g), parallel2 = square(m2 * x + g);
    by_cosine = scale * 2 * (p * m2 * contrast / parallel2 - s * s);
    by_ior = scale * x * (p * (2 * g * g - m2) / parallel2 - s / sum2) * m2_by_ior;
  }

 private:
  // Amplitudes (x - g) / (x + g) and (m2 x - g) / (m2 x + g), with x - g = -contrast / (x + g).
  double across(double x, double g) const { return -contrast / square(x + g); }
  double along(double x, double g) const { return contrast * (x * (x + g) - 1) / ((x + g) * (m2 * x + g)); }
};

/// Smith's G1 of a direction is 2 |cosine| / (|cosine| + root): the denominator and its logarithm's derivatives.
struct Masking {
  Masking(double roughness, double signed_cosine)
      : alpha(roughness),
        cosine(signed_cosine),
        size(std::abs(cosine)),
        root(smith_root(alpha * alpha, size)),
        denominator(size + root) {}
  double by_cosine() const { return std::copysign(1 + (1 - alpha) * (1 + alpha) * size / root, cosine) / denominator; }
  double by_alpha() const { return alpha * (1 - size) * (1 + size) / (root * denominator); }

  double alpha, cosine, size, root, denominator;
};

/// Refraction at the microfacets whose normal is along H = -/+ (w_out + ior w_in), H on the outside. With
/// c = w_out.w_in the squared length of H is q = (ior - 1)^2 + 2 ior (1 + c), H.n = p, and H.w_out and -H.w_in are
/// `outside` and `inside`, all of which must be positive. For directions that obey Snell's law, Fresnel's
/// transmittance is 2 ior outside inside (1 + 1 / c^2) / (ior^2 - 1)^2.
struct Refraction {
  Refraction(const Material& m, double cos_i, double cos_o, double cos_io)
      : ior(m.ior), sign(std::copysign(1.0, m.ior - 1)), cosine(cos_io) {
    const double cos_out = std::max(cos_i, cos_o), a2 = m.roughness * m.roughness;
    cos_in = -std::min(cos_i, cos_o);
    const double contrast = ior - 1, apart = 1 + cos_io;
    p = sign * (contrast * cos_in + (cos_in - cos_out));
    outside = -sign * (contrast * cos_io + apart);
    inside = sign * (contrast + apart);
    const double q = contrast * contrast + 2 * ior * apart;
    excess = std::max(q - p * p, 0.0);  // round-off may take it below zero
    t = a2 * p * p + excess;
    if (!(p > 0 && outside > 0 && inside > 0 && t > 0)) return;
    value = 2 * ior * a2 * kInvPi * square(outside * inside / (contrast * (ior + 1) * t)) * (1 + 1 / (cos_io * cos_io));
  }
  double ior, sign, cosine;
  double cos_in, p, outside, inside, excess, t;
  double value = 0;  ///< transmittance D (H.w_out) (-H.w_in) / q^2
};

double index_of_side(const Material& material, double cosine) {
  return cosine > 0 ? 1 : material.ior;
}

/// Cosine of incidence on the half vector of a reflection.
double incidence(double cos_io) {
  return std::sqrt(0.5 * (1 + cos_io));
}

}  // namespace

double dielectric_lobe(const Material& material, double cos_i, double cos_o, double cos_io) {
  if (cos_i == 0 || cos_o == 0) return 0;
  const double alpha = material.roughness;
  const double masked = Masking(alpha, cos_i).denominator * Masking(alpha, cos_o).denominator;
  if ((cos_i > 0) == (cos_o > 0)) {
    const GgxDensity d(alpha * alpha, std::abs(cos_i), std::abs(cos_o), cos_io);
    if (d.value == 0) return 0;
    return Fresnel(material.ior, cos_o > 0).reflectance(incidence(cos_io)) * d.value / masked;
  }
  return 4 * square(index_of_side(material, cos_o)) * Refraction(material, cos_i, cos_o, cos_io).value / masked;
}

double dielectric_pdf(const Material& material, double cos_i, double cos_o, double cos_io) {
  if (cos_i == 0 || cos_o == 0) return 0;
  const double alpha = material.roughness, masked = Masking(alpha, cos_o).denominator;
  if ((cos_i > 0) == (cos_o > 0)) {
    const GgxDensity d(alpha * alpha, std::abs(cos_i), std::abs(cos_o), cos_io);
    if (d.value == 0) return 0;
    return 0.5 * Fresnel(material.ior, cos_o > 0).reflectance(incidence(cos_io)) * d.value / masked;
  }
  return 2 * square(index_of_side(material, cos_i)) * Refraction(material, cos_i, cos_o, cos_io).value / masked;
}

LobeDerivative dielectric_lobe_derivative(const Material& material, double cos_i, double cos_o, double cos_io) {
  LobeDerivative result;
  result.value = dielectric_lobe(material, cos_i, cos_o, cos_io);
  if (result.value == 0) return {};
  const double alpha = material.roughness, a2 = alpha * alpha, b2 = (1 - alpha) * (1 + alpha);
  const Masking masking_i(alpha, cos_i), masking_o(alpha, cos_o);
  result.d_cos_i = -masking_i.by_cosine();
  result.d_cos_o = -masking_o.by_cosine();
  result.d_roughness = -masking_i.by_alpha() - masking_o.by_alpha();
  if ((cos_i > 0) == (cos_o > 0)) {
    const GgxDensity d(a2, std::abs(cos_i), std::abs(cos_o), cos_io);
    const double by_p = 4 * b2 * d.p / d.t, x = incidence(cos_io);
    double fresnel_by_x, fresnel_by_ior;
    Fresnel(material.ior, cos_o > 0).differentiate(x, fresnel_by_x, fresnel_by_ior);
    result.d_cos_i += std::copysign(by_p, cos_i);
    result.d_cos_o += std::copysign(by_p, cos_o);
    result.d_cos_io = fresnel_by_x / (4 * x) - by_p * d.p / d.q;
    result.d_roughness += 2 * (d.excess - a2 * d.p * d.p) / (alpha * d.t);
    result.d_ior = fresnel_by_ior;
    return result;
  }
  const Refraction r(material, cos_i, cos_o, cos_io);
  const double ior = r.ior, by_p = 4 * b2 * r.p * r.sign / r.t;  // sign: d p / d cosine, of the outside, is -sign
  result.d_cos_i -= by_p * index_of_side(material, cos_i);
  result.d_cos_o -= by_p * index_of_side(material, cos_o);
  result.d_cos_io =
      2 * r.sign * (1 / r.inside - ior / r.outside) - 2 / (cos_io * (1 + cos_io * cos_io)) - 4 * ior / r.t;
  result.d_roughness += 2 * (r.excess - a2 * r.p * r.p) / (alpha * r.t);
  result.d_ior = (cos_o > 0 ? 1 : 3) / ior + 2 * r.sign * (1 / r.inside - cos_io / r.outside) -
                 4 * ior / ((ior - 1) * (ior + 1)) - 4 * (ior + cos_io) / r.t + by_p * r.cos_in;
  return result;
}

std::optional<DirectionSample> dielectric_sample(const Material& material, const Vec3& n, const Vec3& given,
                                                 const Vec3& h, double u, TransportMode mode) {
  const double facing = dot(n, given), x = dot(given, h);
  const Fresnel fresnel(material.ior, facing > 0);
  const bool reflects = u < fresnel.reflectance(x);
  DirectionSample result{};
  if (reflects) {
    result.direction = 2 * x * h - given;
  } else {
    const double bend = fresnel.contrast / (x + fresnel.refracted(x));
    result.direction = (-bend * h - given) * (1 / std::sqrt(fresnel.m2));
  }
  const double cosine = dot(n, result.direction);
  if (cosine == 0 || reflects != ((cosine > 0) == (facing > 0))) return std::nullopt;
  result.pdf = dielectric_pdf(material, cosine, facing, dot(given, result.direction));
  if (!(result.pdf > 0)) return std::nullopt;
  // G1 of the drawn direction. Radiance changes with the squared index of its medium, from the drawn side to the
  // given one; importance, which goes the other way, does not.
  result.weight = 2 * std::abs(cosine) / Masking(material.roughness, cosine).denominator;
  if (!reflects && mode == TransportMode::radiance) result.weight /= fresnel.m2;
  return result;
}

}  // namespace isochron::detail
