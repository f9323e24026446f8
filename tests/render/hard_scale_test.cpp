// A scene that is scaled as a whole, camera and gates included, has the same images in other units: a gated
// image is radiance per length, a derivative by a position is per length once more. Powers of two change no
// mantissa and must give the same bits. Other factors round coordinates again, to double precision in the
// estimators and to single precision for rays: a ray that passes within about 1e-7 of an edge may then miss
// what it hit, and change its path altogether: at most 4 of the 1600 values that are compared at each scale may differ
// by more than 1e-6 of their image's largest. An absolute tolerance anywhere would change them by the hundred.
#include <gtest/gtest.h>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

struct ScaleCase {
  const char* name;
  GateShape (*shape)(double scale);
  Sampling sampling;
};
void PrintTo(const ScaleCase& c, std::ostream* out) {
  *out << c.name;
}

GateShape gaussian(double scale) {
  return GateShape::gaussian(0.3 * scale);
}
GateShape boxcar(double scale) {
  return GateShape::boxcar(0.4 * scale);
}
GateShape narrow(double scale) {
  return GateShape::truncated_gaussian(0.02 * scale, 0.03 * scale);
}
GateShape steady(double) {
  return GateShape::steady();
}

class Scaled : public ::testing::TestWithParam<ScaleCase> {
 protected:
  /// The image, then the derivatives term by term for a shift, a rotation and an albedo, in units of the
  /// scale.
  static std::vector<GatedImage> images(double scale) {
    Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
    scene.camera.width = scene.camera.height = 8;
    for (Vec3& p : scene.positions) p *= scale;
    scene.camera.position *= scale;
    scene.camera.look_at *= scale;
    const TangentBasis basis = make_basis(
        scene, {translate(scene, "block", {1, 0.3, 0}), translate(scene, "light", {0.2, 1, 0.5}),
                rotate_y(scene, "block", Vec3{-0.2, 0, 0.15} * scale), change_material(scene, "panel", "albedo")});
    const GateShape shape = GetParam().shape(scale);
    const GateSet gates(shape, {5.2 * scale, 6.0 * scale});
    const double per_length = shape.is_steady() ? 1 : scale;  // gated images are radiance per length
    const Renderer renderer(scene, gates, {.max_bounces = 3, .sampling = GetParam().sampling}, &basis);
    std::vector<GatedImage> all{renderer.render({51, 0, 0}, {0, 32})};
    std::vector<double> unit{per_length};
    for (const Term term : kTerms) {
      const auto derivatives = renderer.derive(term, {51, 0, 1 + static_cast<std::uint32_t>(term)}, {0, 32});
      for (std::size_t i = 0; i < derivatives.size(); ++i) {
        all.push_back(derivatives[i]);
        unit.push_back(i < 2 ? per_length * scale : per_length);
      }
    }
    for (std::size_t i = 0; i < all.size(); ++i)
      for (double& x : all[i].data) x *= unit[i];
    return all;
  }
};

TEST_P(Scaled, PowersOfTwoGiveTheSameBits) {
  const auto original = images(1);
  for (const double scale : {0x1p-10, 0x1p10}) {
    const auto scaled = images(scale);
    for (std::size_t i = 0; i < original.size(); ++i)
      EXPECT_EQ(scaled[i].data, original[i].data) << "image " << i << ", scale " << scale;
  }
}

TEST_P(Scaled, OtherFactorsGiveTheSameImages) {
  const auto original = images(1);
  int lit = 0;
  for (const double scale : {1e-3, 1e3}) {
    const auto scaled = images(scale);
    int different = 0;
    for (std::size_t i = 0; i < original.size(); ++i) {
      double largest = 0;
      for (double value : original[i].data) largest = std::max(largest, std::abs(value));
      for (std::size_t k = 0; k < original[i].data.size(); ++k)
        different += std::abs(scaled[i].data[k] - original[i].data[k]) > 1e-6 * largest;
      lit += largest > 0;
    }
    EXPECT_LE(different, 4) << "scale " << scale;
  }
  EXPECT_GT(lit, 8);
}

INSTANTIATE_TEST_SUITE_P(Gates, Scaled,
                         ::testing::Values(ScaleCase{"gaussian_standard", gaussian, Sampling::standard},
                                           ScaleCase{"boxcar_standard", boxcar, Sampling::standard},
                                           ScaleCase{"boxcar_ellipsoidal", boxcar, Sampling::ellipsoidal},
                                           ScaleCase{"gaussian_ellipsoidal", gaussian, Sampling::ellipsoidal},
                                           ScaleCase{"narrow_automatic", narrow, Sampling::automatic},
                                           ScaleCase{"steady_automatic", steady, Sampling::automatic}),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace isochron::testing
