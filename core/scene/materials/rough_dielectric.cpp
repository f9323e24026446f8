// The rough dielectric is the boundary of a solid of index `ior`: the front of its faces is outside (index 1), the
// back inside. Cosines of equal sign mean reflection, of opposite sign refraction. It is the single-scattering GGX
// of Walter et al. 2007 with unpolarised Fresnel reflectance and separable masking-shadowing G1 G1, written in the three
// cosines so that nothing cancels near normal incidence, near grazing, near the critical angle or for indices close to one.
// Radiance changes by refraction with the square of the index of its medium.
// As in that model, f ends with a jump where the half vector of a refraction lies in the surface, at alpha^4 of its
// peak; derivatives leave out the motion of that jump.
#include "core/scene/materials/fresnel.h"
#include "core/scene/materials/ggx.h"
#include "core/scene/materials/material.h"

namespace isochron {
namespace {

/// Smith's G1 of a direction is 2 |cosine| / (|cosine| + root): the denominator and its logarithm's derivatives.
struct Masking {
  Masking(double roughness, double signed_cosine)
      : alpha(roughness),
        cosine(signed_cosine),
        size(std::abs(cosine)),
        root(ggx::smith_root(alpha * alpha, size)),
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
  Refraction(double alpha, double index, double cos_i, double cos_o, double cos_io)
      : ior(index), sign(std::copysign(1.0, index - 1)), cosine(cos_io) {
    const double cos_out = std::max(cos_i, cos_o), a2 = alpha * alpha;
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

class RoughDielectric final : public Bsdf {
 public:
  std::unique_ptr<Bsdf> clone() const override { return std::make_unique<RoughDielectric>(*this); }

  void describe(Keys& keys, bool&) override {
    const auto check_ior = [this](const YamlValue& value) {
      if (ior_ == 1) value.fail("1 is no boundary", "a number above 0 other than 1");
    };
    keys.value("roughness", field::number(alpha_, {.low = 0, .high = 1, .low_open = true}), "alpha of GGX",
               {.required = true});
    keys.value("ior", field::checked(field::positive(ior_), check_ior), "index of refraction, other than 1",
               {.required = true});
  }
  std::vector<Quantity> quantities() override {
    return {{"roughness", {&alpha_, 1}, roughness_range}, {"ior", {&ior_, 1}, ior_range}};
  }

  Rgb value(const Directions& d) const override { return Rgb(scattered(d)); }
  BsdfDerivative derivative(const Directions& d) const override;
  double pdf(const Directions& d) const override;
  std::optional<DirectionSample> sample(const Vec3& n, const Vec3& given, double u0, double u1, double u2,
                                        TransportMode mode) const override;
  int dimensions() const override { return 3; }
  int index_number() const override { return 1; }

 private:
  /// An index stays on its side of 1.
  static Quantity::Range ior_range(double initial) {
    constexpr double kLeastContrast = 1e-3;
    if (initial > 1) return {1 + kLeastContrast, std::numeric_limits<double>::infinity()};
    return {kLeastContrast, 1 - kLeastContrast};
  }
  double index_of_side(double cosine) const { return cosine > 0 ? 1 : ior_; }
  double scattered(const Directions& d) const;

  double alpha_ = 0.2, ior_ = 1.5;
};

double RoughDielectric::scattered(const Directions& d) const {
  if (d.cos_i == 0 || d.cos_o == 0) return 0;
  const double masked = Masking(alpha_, d.cos_i).denominator * Masking(alpha_, d.cos_o).denominator;
  if ((d.cos_i > 0) == (d.cos_o > 0)) {
    const ggx::Density facets(alpha_ * alpha_, std::abs(d.cos_i), std::abs(d.cos_o), d.cos_io);
    if (facets.value == 0) return 0;
    return Fresnel(ior_, d.cos_o > 0).reflectance(incidence(d.cos_io)) * facets.value / masked;
  }
  return 4 * square(index_of_side(d.cos_o)) * Refraction(alpha_, ior_, d.cos_i, d.cos_o, d.cos_io).value / masked;
}

double RoughDielectric::pdf(const Directions& d) const {
  if (d.cos_i == 0 || d.cos_o == 0) return 0;
  const double masked = Masking(alpha_, d.cos_o).denominator;
  if ((d.cos_i > 0) == (d.cos_o > 0)) {
    const ggx::Density facets(alpha_ * alpha_, std::abs(d.cos_i), std::abs(d.cos_o), d.cos_io);
    if (facets.value == 0) return 0;
    return 0.5 * Fresnel(ior_, d.cos_o > 0).reflectance(incidence(d.cos_io)) * facets.value / masked;
  }
  return 2 * square(index_of_side(d.cos_i)) * Refraction(alpha_, ior_, d.cos_i, d.cos_o, d.cos_io).value / masked;
}

BsdfDerivative RoughDielectric::derivative(const Directions& d) const {
  BsdfDerivative result;
  if (scattered(d) == 0) return result;
  const double a2 = alpha_ * alpha_, b2 = (1 - alpha_) * (1 + alpha_);
  const Masking masking_i(alpha_, d.cos_i), masking_o(alpha_, d.cos_o);
  double by_cos_i = -masking_i.by_cosine(), by_cos_o = -masking_o.by_cosine(), by_cos_io;
  double by_alpha = -masking_i.by_alpha() - masking_o.by_alpha(), by_ior;
  if ((d.cos_i > 0) == (d.cos_o > 0)) {
    const ggx::Density facets(a2, std::abs(d.cos_i), std::abs(d.cos_o), d.cos_io);
    const double by_p = 4 * b2 * facets.p / facets.t, x = incidence(d.cos_io);
    double fresnel_by_x;
    Fresnel(ior_, d.cos_o > 0).differentiate(x, fresnel_by_x, by_ior);
    by_cos_i += std::copysign(by_p, d.cos_i);
    by_cos_o += std::copysign(by_p, d.cos_o);
    by_cos_io = fresnel_by_x / (4 * x) - by_p * facets.p / facets.q;
    by_alpha += 2 * (facets.excess - a2 * facets.p * facets.p) / (alpha_ * facets.t);
  } else {
    const Refraction r(alpha_, ior_, d.cos_i, d.cos_o, d.cos_io);
    const double c = d.cos_io, by_p = 4 * b2 * r.p * r.sign / r.t;  // sign: d p / d cosine, of the outside, is -sign
    by_cos_i -= by_p * index_of_side(d.cos_i);
    by_cos_o -= by_p * index_of_side(d.cos_o);
    by_cos_io = 2 * r.sign * (1 / r.inside - ior_ / r.outside) - 2 / (c * (1 + c * c)) - 4 * ior_ / r.t;
    by_alpha += 2 * (r.excess - a2 * r.p * r.p) / (alpha_ * r.t);
    by_ior = (d.cos_o > 0 ? 1 : 3) / ior_ + 2 * r.sign * (1 / r.inside - c / r.outside) -
             4 * ior_ / ((ior_ - 1) * (ior_ + 1)) - 4 * (ior_ + c) / r.t + by_p * r.cos_in;
  }
  result.set_cosines(d, 1, by_cos_i, by_cos_o, by_cos_io);
  result.by_number[0] = Rgb(by_alpha);
  result.by_number[1] = Rgb(by_ior);
  return result;
}

std::optional<DirectionSample> RoughDielectric::sample(const Vec3& n, const Vec3& given, double u0, double u1,
                                                       double u2, TransportMode mode) const {
  const double facing = dot(n, given);
  if (facing == 0) return std::nullopt;
  // The microfacet is on the side of `given`; Fresnel's reflectance decides between the two ways to go on.
  const Vec3 h = ggx::sample_visible_normal(alpha_, facing < 0 ? -n : n, given, u0, u1);
  const double x = dot(given, h);
  const Fresnel fresnel(ior_, facing > 0);
  const bool reflects = u2 < fresnel.reflectance(x);
  Vec3 direction;
  if (reflects) {
    direction = 2 * x * h - given;
  } else {
    const double bend = fresnel.contrast / (x + fresnel.refracted(x));
    direction = (-bend * h - given) * (1 / std::sqrt(fresnel.m2));
  }
  const double cosine = dot(n, direction);
  if (cosine == 0 || reflects != ((cosine > 0) == (facing > 0))) return std::nullopt;
  const double density = pdf({n, direction, given, cosine, facing, dot(given, direction)});
  if (!(density > 0)) return std::nullopt;
  // G1 of the drawn direction. Radiance changes with the squared index of its medium, from the drawn side to the
  // given one; importance, which goes the other way, does not.
  double weight = 2 * std::abs(cosine) / Masking(alpha_, cosine).denominator;
  if (!reflects && mode == TransportMode::radiance) weight /= fresnel.m2;
  return DirectionSample{direction, density, Rgb(weight)};
}

}  // namespace

extern const MaterialKind kRoughDielectric;
const MaterialKind kRoughDielectric{"rough_dielectric", "a solid behind a closed mesh; GGX",
                                    make_bsdf<RoughDielectric>};

}  // namespace isochron
