// The diffuse material: f = albedo / pi.
#include "core/scene/materials/material.h"

namespace isochron {
namespace {

class Diffuse final : public Bsdf {
 public:
  std::unique_ptr<Bsdf> clone() const override { return std::make_unique<Diffuse>(*this); }

  void describe(Keys& keys, bool& grey) override {
    keys.value("albedo", field::color(albedo_, NumberRange::closed(0, 1), grey), "fraction of light that is reflected",
               {.required = true});
    describe_two_sided(keys);
  }
  std::vector<Quantity> quantities() override { return {{"albedo", numbers_of(albedo_), fraction_range}}; }

  Rgb value(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? albedo_ * kInvPi : Rgb();
  }
  BsdfDerivative derivative(const Directions& directions) const override {
    Directions d = directions;
    BsdfDerivative result;
    if (face_forward(d) == 0) return result;
    for (int c = 0; c < 3; ++c)
      if (albedo_[c] > 0) result.by_number[c][c] = 1 / albedo_[c];
    return result;
  }
  double pdf(const Directions& directions) const override {
    Directions d = directions;
    return face_forward(d) != 0 ? d.cos_i * kInvPi : 0;
  }
  std::optional<DirectionSample> sample(const Vec3& normal, const Vec3& given, double u0, double u1, double,
                                        TransportMode) const override {
    Vec3 n = normal;
    if (!face_forward(n, given)) return std::nullopt;
    const Vec3 direction = sample_cosine(n, u0, u1);
    const double cosine = dot(n, direction);
    if (!(cosine > 0)) return std::nullopt;
    return DirectionSample{direction, cosine * kInvPi, albedo_};
  }
  bool depends_on_directions() const override { return false; }

 private:
  Rgb albedo_{0.5};
};

}  // namespace

extern const MaterialKind kDiffuse;
const MaterialKind kDiffuse{"diffuse", "the same in all directions", make_bsdf<Diffuse>};

}  // namespace isochron
