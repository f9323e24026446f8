// The rough conductor: mirrors of the GGX law with a constant reflectance, f = reflectance * ggx::reflection.
#include "core/scene/materials/ggx.h"
#include "core/scene/materials/material.h"

namespace isochron {
namespace {

class RoughConductor final : public Bsdf {
 public:
  std::unique_ptr<Bsdf> clone() const override { return std::make_unique<RoughConductor>(*this); }

  void describe(Keys& keys, bool& grey) override {
    keys.value("reflectance", field::color(reflectance_, NumberRange::closed(0, 1), grey),
               "of each of its facets, at any angle", {.required = true});
    keys.value("roughness", field::number(alpha_, {.low = 0, .high = 1, .low_open = true}), "alpha of GGX",
               {.required = true});
    describe_two_sided(keys);
  }
  std::vector<Quantity> quantities() override {
    return {{"reflectance", numbers_of(reflectance_), fraction_range, "albedo"},
            {"roughness", {&alpha_, 1}, roughness_range}};
  }

  Rgb value(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? reflectance_ * ggx::reflection(alpha_, d.cos_i, d.cos_o, d.cos_io) : Rgb();
  }
  BsdfDerivative derivative(const Directions& directions) const override {
    Directions d = directions;
    BsdfDerivative result;
    const double side = face_forward(d);
    if (side == 0) return result;
    const ggx::ReflectionDerivative g = ggx::differentiate_reflection(alpha_, d.cos_i, d.cos_o, d.cos_io);
    if (g.value == 0) return result;
    result.set_cosines(d, side, g.by_cos_i, g.by_cos_o, g.by_cos_io);
    for (int c = 0; c < 3; ++c)
      if (reflectance_[c] > 0) result.by_number[c][c] = 1 / reflectance_[c];
    result.by_number[3] = Rgb(g.by_alpha);
    return result;
  }
  double pdf(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? ggx::reflection_pdf(alpha_, d.cos_i, d.cos_o, d.cos_io) : 0;
  }
  std::optional<DirectionSample> sample(const Vec3& normal, const Vec3& given, double u0, double u1, double,
                                        TransportMode) const override {
    Vec3 n = normal;
    if (!face_forward(n, given)) return std::nullopt;
    const Vec3 h = ggx::sample_visible_normal(alpha_, n, given, u0, u1);
    const Vec3 direction = 2 * dot(given, h) * h - given;
    const double cosine = dot(n, direction), cos_given = dot(n, given);
    if (!(cosine > 0)) return std::nullopt;
    const double density = ggx::reflection_pdf(alpha_, cosine, cos_given, dot(given, direction));
    if (!(density > 0)) return std::nullopt;
    return DirectionSample{direction, density, reflectance_ * ggx::reflection_weight(alpha_, cosine, cos_given)};
  }

 private:
  Rgb reflectance_{0.5};
  double alpha_ = 0.2;
};

}  // namespace

extern const MaterialKind kRoughConductor;
const MaterialKind kRoughConductor{"rough_conductor", "mirrors of the GGX law", make_bsdf<RoughConductor>};

}  // namespace isochron
