// Each technique of the visibility term can be left out: the mean stays, under wide gates and under narrow ones, which add
// techniques at given lengths.
//
// Statistics: z-tests at 4.5 standard errors (false alarms: 7e-6 each, 7e-5 for the file) of differences that are known to a
// tenth of the derivative or better.
#include <gtest/gtest.h>

#include "support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

struct Without {
  const char* name;
  bool BoundaryTechniques::*technique;
};
constexpr Without kWithout[] = {{"wedge", &BoundaryTechniques::wedge},
                                {"aimed", &BoundaryTechniques::aimed},
                                {"from_camera", &BoundaryTechniques::from_camera},
                                {"at_length", &BoundaryTechniques::at_length},
                                {"light_arcs", &BoundaryTechniques::light_arcs}};

class LeftOut : public ::testing::TestWithParam<bool> {};

TEST_P(LeftOut, MeanStays) {
  const bool narrow = GetParam();
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 8;
  const TangentBasis basis = make_basis(scene, {translate(scene, "block", {0.3, 1, 0.2})});
  const GateSet gates(GateShape::gaussian(narrow ? 0.1 : 0.6), {5.5});
  EstimatorOptions options{.max_bounces = 2, .sampling = narrow ? Sampling::ellipsoidal : Sampling::standard};
  const auto derivative = [&](std::uint32_t seed, int samples) {
    return term_means(Renderer(scene, gates, options, &basis), Term::visibility, 1, 1, samples, 32,
                      {test_seed(seed), 0, 0})[0][0];
  };
  const Estimate all = derivative(71, 1024);
  for (std::uint32_t i = 0; i < std::size(kWithout); ++i) {
    options.boundary = {};
    options.boundary.*kWithout[i].technique = false;
    const Estimate left = derivative(72 + i, 512);
    EXPECT_LT(std::abs(z_score(left, all)), 4.5)
        << kWithout[i].name << ": " << left.mean << " +- " << left.standard_error << ", all " << all.mean << " +- "
        << all.standard_error;
    EXPECT_LT(std::hypot(left.standard_error, all.standard_error), 0.1 * std::abs(all.mean)) << kWithout[i].name;
  }
}

INSTANTIATE_TEST_SUITE_P(Gates, LeftOut, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "narrow" : "wide"; });

}  // namespace
}  // namespace isochron::testing
