// The retroreflecting material: a share of the light goes back around the way that it came, the rest is scattered diffusely,
//
//   f = albedo / pi + reflectance * ggx::reflection(w_i, v),       v = 2 cos_o n - w_o.
//
// v is w_o mirrored about the normal: mirrors send light to v, the retroreflector to w_o. Its lobe is theirs with
// cos_io replaced by w_i.v = 2 cos_i cos_o - cos_io, so that it is as reciprocal and keeps as much of the energy.
#include "core/scene/materials/ggx.h"
#include "core/scene/materials/material.h"

namespace isochron {
namespace {

class Retroreflecting final : public Bsdf {
 public:
  std::unique_ptr<Bsdf> clone() const override { return std::make_unique<Retroreflecting>(*this); }

  void describe(Keys& keys, bool& grey) override {
    keys.value("albedo", field::color(albedo_, NumberRange::closed(0, 1), grey),
               "fraction of light that is scattered diffusely", {.required = true});
    const auto check_energy = [this](const YamlValue& value) {
      if ((albedo_ + reflectance_).max() > 1)
        value.fail("albedo and reflectance add up to more than 1", "a sum of at most 1");
    };
    keys.value("reflectance", field::checked(field::color(reflectance_, NumberRange::closed(0, 1), grey), check_energy),
               "fraction of light that returns the way it came", {.required = true});
    keys.value("roughness", field::number(alpha_, {.low = 0, .high = 1, .low_open = true}),
               "alpha of GGX: width of the returning lobe", {.required = true});
    describe_two_sided(keys);
  }
  std::vector<Quantity> quantities() override {
    return {{"albedo", numbers_of(albedo_), fraction_range},
            {"reflectance", numbers_of(reflectance_), fraction_range},
            {"roughness", {&alpha_, 1}, roughness_range}};
  }

  Rgb value(const Directions& directions) const override {
    Directions d = directions;
    if (face_forward(d) == 0) return Rgb();
    return albedo_ * kInvPi + reflectance_ * ggx::reflection(alpha_, d.cos_i, d.cos_o, mirrored(d));
  }
  BsdfDerivative derivative(const Directions& directions) const override {
    Directions d = directions;
    BsdfDerivative result;
    const double side = face_forward(d);
    if (side == 0) return result;
    const ggx::ReflectionDerivative g = ggx::differentiate_reflection(alpha_, d.cos_i, d.cos_o, mirrored(d));
    result.coloured = albedo_ != Rgb(albedo_.r) || reflectance_ != Rgb(reflectance_.r);
    for (int c = 0; c < 3; ++c) {
      const double f = albedo_[c] * kInvPi + reflectance_[c] * g.value;
      if (!(f > 0)) continue;
      const double of_lobe = reflectance_[c] * g.value / f;
      result.set_cosines(c, d, side, of_lobe * (g.by_cos_i + 2 * d.cos_o * g.by_cos_io),
                         of_lobe * (g.by_cos_o + 2 * d.cos_i * g.by_cos_io), -of_lobe * g.by_cos_io);
      result.by_number[c][c] = kInvPi / f;
      result.by_number[3 + c][c] = g.value / f;
      result.by_number[6][c] = of_lobe * g.by_alpha;
    }
    return result;
  }
  double pdf(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? density(d.cos_i, d.cos_o, mirrored(d)) : 0;
  }
  std::optional<DirectionSample> sample(const Vec3& normal, const Vec3& given, double u0, double u1, double u2,
                                        TransportMode) const override {
    Vec3 n = normal;
    if (!face_forward(n, given)) return std::nullopt;
    const double cos_given = dot(n, given);
    const Vec3 v = 2 * cos_given * n - given;
    Vec3 direction;
    if (u2 < lobe_share()) {
      const Vec3 h = ggx::sample_visible_normal(alpha_, n, v, u0, u1);
      direction = 2 * dot(v, h) * h - v;
    } else {
      direction = sample_cosine(n, u0, u1);
    }
    const double cosine = dot(n, direction), cos_lobe = dot(direction, v);
    if (!(cosine > 0)) return std::nullopt;
    const double pdf = density(cosine, cos_given, cos_lobe);
    if (!(pdf > 0)) return std::nullopt;
    const Rgb f = albedo_ * kInvPi + reflectance_ * ggx::reflection(alpha_, cosine, cos_given, cos_lobe);
    return DirectionSample{direction, pdf, f * (cosine / pdf)};
  }
  int dimensions() const override { return 3; }

 private:
  static double mirrored(const Directions& d) { return 2 * d.cos_i * d.cos_o - d.cos_io; }
  /// Share of the samples.
  double lobe_share() const {
    const double diffuse = albedo_.max(), lobe = reflectance_.max();
    return lobe > 0 ? lobe / (diffuse + lobe) : 0;
  }
  double density(double cos_i, double cos_o, double cos_lobe) const {
    const double share = lobe_share();
    return share * ggx::reflection_pdf(alpha_, cos_i, cos_o, cos_lobe) + (1 - share) * cos_i * kInvPi;
  }

  Rgb albedo_{0.2}, reflectance_{0.6};
  double alpha_ = 0.1;
};

}  // namespace

extern const MaterialKind kRetroreflecting;
const MaterialKind kRetroreflecting{"retroreflecting", "back the way the light came, and diffusely",
                                    make_bsdf<Retroreflecting>};

}  // namespace isochron
