// Plastic, varnish, glazed ceramics: a diffuse base under a rough dielectric coat of index n,
//
//   f = base / pi T(cos_i) T(cos_o) + reflectance F ggx::reflection,     base = albedo / (n^2 (1 - albedo F_in)).
//
// F is Fresnel's reflectance of the facets, T = 1 - F what a smooth coat lets through, and F_in the share of the base's
// light that the coat sends back to it, again and again. White plastic under a smooth coat keeps all light, as
// n^2 (1 - F_in) = 1 - F_out with F_out the same share for light from outside. A rough coat mirrors less than a smooth one
// towards grazing, and up to 0.07 % more where Fresnel's curve bends (quadrature, indices from 1.3 to 2.5).
#include "core/scene/materials/fresnel.h"
#include "core/scene/materials/ggx.h"
#include "core/scene/materials/material.h"

namespace isochron {
namespace {

/// Reflectance of a smooth coat for diffuse light from outside, 2 int F(x) x dx, and its derivative by the index. Simpson's rule
/// in the root of the cosine, where F is smooth also for an index close to one.
void diffuse_reflectance(double ior, double& value, double& by_ior) {
  constexpr int kIntervals = 256;
  const Fresnel fresnel(ior, true);
  value = by_ior = 0;
  for (int k = 0; k <= kIntervals; ++k) {
    const double root = static_cast<double>(k) / kIntervals, x = root * root;
    const double weight = (k == 0 || k == kIntervals ? 1 : k % 2 ? 4 : 2) / (3.0 * kIntervals) * 4 * root * x;
    double by_cosine, log_by_ior;
    fresnel.differentiate(x, by_cosine, log_by_ior);
    value += weight * fresnel.reflectance(x);
    by_ior += weight * fresnel.reflectance(x) * log_by_ior;
  }
}

class Plastic final : public Bsdf {
 public:
  Plastic() { numbers_changed(); }
  std::unique_ptr<Bsdf> clone() const override { return std::make_unique<Plastic>(*this); }

  void describe(Keys& keys, bool& grey) override {
    const auto follow = [this](const YamlValue&) { numbers_changed(); };
    keys.value("albedo", field::color(albedo_, NumberRange::closed(0, 1), grey),
               "fraction of light that the base reflects diffusely", {.required = true});
    keys.value("roughness", field::number(alpha_, {.low = 0, .high = 1, .low_open = true}), "alpha of GGX, of the coat",
               {.required = true});
    keys.value("ior", field::checked(field::number(ior_, {.low = 1, .low_open = true}), follow),
               "index of refraction of the coat");
    keys.value("reflectance", field::color(reflectance_, NumberRange::closed(0, 1), grey),
               "factor on the coat's reflection");
    describe_two_sided(keys);
  }
  std::vector<Quantity> quantities() override {
    return {{"albedo", numbers_of(albedo_), fraction_range},
            {"reflectance", numbers_of(reflectance_), fraction_range},
            {"roughness", {&alpha_, 1}, roughness_range},
            {"ior", {&ior_, 1}, ior_range}};
  }
  void numbers_changed() override {
    diffuse_reflectance(ior_, outside_, outside_by_ior_);
    const double n2 = ior_ * ior_;
    inside_ = 1 - (1 - outside_) / n2;
    inside_by_ior_ = outside_by_ior_ / n2 + 2 * (1 - outside_) / (n2 * ior_);
  }

  Rgb value(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? scattered(d.cos_i, d.cos_o, d.cos_io) : Rgb();
  }
  BsdfDerivative derivative(const Directions& directions) const override;
  double pdf(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? density(d.cos_i, d.cos_o, d.cos_io) : 0;
  }
  std::optional<DirectionSample> sample(const Vec3& normal, const Vec3& given, double u0, double u1, double u2,
                                        TransportMode) const override {
    Vec3 n = normal;
    if (!face_forward(n, given)) return std::nullopt;
    const double cos_given = dot(n, given);
    Vec3 direction;
    if (u2 < coat_share(cos_given)) {
      const Vec3 h = ggx::sample_visible_normal(alpha_, n, given, u0, u1);
      direction = 2 * dot(given, h) * h - given;
    } else {
      direction = sample_cosine(n, u0, u1);
    }
    const double cosine = dot(n, direction), cos_io = dot(given, direction);
    if (!(cosine > 0)) return std::nullopt;
    const double pdf = density(cosine, cos_given, cos_io);
    if (!(pdf > 0)) return std::nullopt;
    return DirectionSample{direction, pdf, scattered(cosine, cos_given, cos_io) * (cosine / pdf)};
  }
  int dimensions() const override { return 3; }

 private:
  static Quantity::Range ior_range(double) {
    constexpr double kLeastContrast = 1e-3;
    return {1 + kLeastContrast, std::numeric_limits<double>::infinity()};
  }
  double base(double albedo) const { return albedo / (square(ior_) * (1 - albedo * inside_)); }
  Rgb scattered(double cos_i, double cos_o, double cos_io) const {
    const Fresnel coat(ior_, true);
    const double through = kInvPi * (1 - coat.reflectance(cos_i)) * (1 - coat.reflectance(cos_o));
    const double mirrored = coat.reflectance(incidence(cos_io)) * ggx::reflection(alpha_, cos_i, cos_o, cos_io);
    Rgb f = reflectance_ * mirrored;
    for (int c = 0; c < 3; ++c) f[c] += base(albedo_[c]) * through;
    return f;
  }
  /// Share of the samples that are drawn from the coat's lobe: that of the reflected light, were the coat smooth.
  double coat_share(double cos_given) const {
    const double mirrored = Fresnel(ior_, true).reflectance(cos_given);
    const double coat = reflectance_.max() * mirrored;
    const double diffuse = base(albedo_.max()) * (1 - mirrored) * (1 - outside_);
    return coat > 0 ? coat / (coat + diffuse) : 0;
  }
  double density(double cos_i, double cos_o, double cos_io) const {
    const double share = coat_share(cos_o);
    return share * ggx::reflection_pdf(alpha_, cos_i, cos_o, cos_io) + (1 - share) * cos_i * kInvPi;
  }

  Rgb albedo_{0.5}, reflectance_{1.0};
  double alpha_ = 0.1, ior_ = 1.5;
  double outside_, outside_by_ior_;  ///< F_out
  double inside_, inside_by_ior_;    ///< F_in
};

BsdfDerivative Plastic::derivative(const Directions& directions) const {
  Directions d = directions;
  BsdfDerivative result;
  const double side = face_forward(d);
  if (side == 0) return result;
  const Fresnel coat(ior_, true);
  const auto reflectance = [&](double cosine, double& by_cosine, double& by_ior) {
    const double value = coat.reflectance(cosine);
    coat.differentiate(cosine, by_cosine, by_ior);
    by_cosine *= value;
    by_ior *= value;
    return value;
  };
  double i_by_cosine, i_by_ior, o_by_cosine, o_by_ior, h_by_cosine, h_by_ior;
  const double through_i = 1 - reflectance(d.cos_i, i_by_cosine, i_by_ior);
  const double through_o = 1 - reflectance(d.cos_o, o_by_cosine, o_by_ior);
  const double x = incidence(d.cos_io), facet = reflectance(x, h_by_cosine, h_by_ior);
  const ggx::ReflectionDerivative g = ggx::differentiate_reflection(alpha_, d.cos_i, d.cos_o, d.cos_io);
  result.coloured = albedo_ != Rgb(albedo_.r) || reflectance_ != Rgb(reflectance_.r);
  for (int c = 0; c < 3; ++c) {
    const double left = 1 - albedo_[c] * inside_, a = base(albedo_[c]) * kInvPi;
    const double diffuse = a * through_i * through_o, lobe = reflectance_[c] * facet * g.value;
    const double f = diffuse + lobe;
    if (!(f > 0)) continue;
    const double by_facet = reflectance_[c] * g.value;
    // d x / d cos_io = 1 / (4 x); where x is 0 the lobe is.
    const double by_cos_io = lobe * g.by_cos_io + (x > 0 ? by_facet * h_by_cosine / (4 * x) : 0);
    result.set_cosines(c, d, side, (lobe * g.by_cos_i - a * i_by_cosine * through_o) / f,
                       (lobe * g.by_cos_o - a * through_i * o_by_cosine) / f, by_cos_io / f);
    result.by_number[c][c] = kInvPi * through_i * through_o / square(ior_ * left) / f;
    result.by_number[3 + c][c] = facet * g.value / f;
    result.by_number[6][c] = lobe * g.by_alpha / f;
    const double base_by_ior = albedo_[c] * inside_by_ior_ / left - 2 / ior_;
    result.by_number[7][c] =
        (diffuse * base_by_ior - a * (i_by_ior * through_o + through_i * o_by_ior) + by_facet * h_by_ior) / f;
  }
  return result;
}

}  // namespace

extern const MaterialKind kPlastic;
const MaterialKind kPlastic{"plastic", "a diffuse base under a coat that mirrors by the GGX law", make_bsdf<Plastic>};

}  // namespace isochron
