// Hidden geometry sampling in a camera's walks: derivatives have the means that BSDF sampling alone gives.
//
// Statistics: z-tests at 4.5 standard errors of the difference, of 8 derivatives (false alarms: 7e-6 each), fixed seeds. Both
// standard errors must be below 3 % of the derivative's scale, so that a density that lacks a term or a factor fails.
#include <gtest/gtest.h>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

class HiddenWalk : public ::testing::TestWithParam<GateShape> {};

/// A block, a glossy panel and the light itself are hidden geometry, so that emitters are met by area, too, and steps start
/// on all kinds of materials.
TEST_P(HiddenWalk, LeavesDerivativesUnbiased) {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 16;
  replace_material(scene, "panel", conductor(Rgb(0.7), 0.5, true));
  for (const char* shape : {"block", "panel", "light"}) scene.shapes[scene.find_shape(shape)].hidden = true;
  const TangentBasis basis =
      make_basis(scene, {translate(scene, "block", {0.3, 1, 0.2}), translate(scene, "light", {0.4, 0, 0.3})});
  const GateSet gates(GetParam(), {5.0, 6.0});
  EstimatorOptions options{.max_bounces = 3, .sampling = Sampling::standard};
  const Renderer plain(scene, gates, options, &basis);
  options.hidden = 0.5;
  const Renderer ours(scene, gates, options, &basis);
  constexpr int kBatches = 32, kSamples = 600;
  const auto expected = term_means(plain, Term::interior, 2, 2, kSamples, kBatches, {71, 0, 0});
  const auto found = term_means(ours, Term::interior, 2, 2, kSamples, kBatches, {72, 0, 0});
  for (int m = 0; m < 2; ++m) {
    const double scale = std::hypot(expected[m][0].mean, expected[m][1].mean) / std::sqrt(2.0);
    for (int g = 0; g < 2; ++g) {
      const Estimate &a = found[m][g], &b = expected[m][g];
      EXPECT_LT(std::abs(z_score(a, b)), 4.5)
          << "motion " << m << " gate " << g << ": " << a.mean << " +- " << a.standard_error << ", without " << b.mean
          << " +- " << b.standard_error;
      EXPECT_LT(a.standard_error, 0.03 * scale) << "motion " << m << " gate " << g;
      EXPECT_LT(b.standard_error, 0.03 * scale) << "motion " << m << " gate " << g;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Gates, HiddenWalk, ::testing::Values(GateShape::gaussian(0.3), GateShape::boxcar(0.8)));

/// A step that only hidden geometry can take part in: of a scene that is all hidden geometry nothing changes.
TEST(HiddenGeometry, IsLeftOutWhereItIsAll) {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 4;
  for (Shape& shape : scene.shapes) shape.hidden = true;
  const TangentBasis basis = make_basis(scene, {translate(scene, "block", {0.3, 1, 0.2})});
  const GateSet gates(GateShape::gaussian(0.3), {5.0, 6.0});
  EstimatorOptions options{.max_bounces = 3, .sampling = Sampling::standard};
  const Renderer plain(scene, gates, options, &basis);
  options.hidden = 0.5;
  const Renderer ours(scene, gates, options, &basis);
  const auto expected = term_means(plain, Term::interior, 1, 2, 8, 2, {73, 0, 0}),
             found = term_means(ours, Term::interior, 1, 2, 8, 2, {73, 0, 0});
  for (int g = 0; g < 2; ++g) EXPECT_EQ(found[0][g].mean, expected[0][g].mean);
}

}  // namespace
}  // namespace isochron::testing
