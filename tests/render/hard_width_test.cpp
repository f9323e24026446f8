// The variance of the gate's derivative against gate width as theory section 7 has it: width^-3 for standard
// sampling, width^-2 for ellipsoidal sampling without coupling; with coupled pairs width^-1 where they can
// straddle a shadow's edge, and bounded where nothing parts them. In the scene without shadows the bound
// shows only below 1e-4 of the path length: up to there arcs are cut off at rates that pairs do not resolve,
// and the variance grows as if they were parted.
//
// Each variance comes from 64 batches (standard deviation 18 %, more where it is rare events that make it),
// so that exponents fitted over three decades are good to about 0.1, over one to 0.25; fixed seed.
// Neighbouring laws are 1 apart.
#include <gtest/gtest.h>

#include "tests/render/width_growth.h"

namespace isochron::testing {
namespace {

double exponent(const Scene& scene, const GrowthMethod& method, int samples,
                const std::vector<double>& widths) {
  std::vector<double> variances;
  for (const double width : widths) {
    const double error = growth_estimate(scene, method, width, samples, 64).standard_error;
    variances.push_back(error * error);
  }
  const double fitted = fitted_exponent(widths, variances);
  ::testing::Test::RecordProperty(method.name, std::to_string(fitted));
  return fitted;
}

const std::vector<double> kDecades = {1e-2, 1e-3, 1e-4, 1e-5};

TEST(WidthGrowth, WithoutShadowEdges) {
  const Scene scene = growth_scene(false);
  EXPECT_NEAR(exponent(scene, kGrowthMethods[0], 400, kDecades), -3, 0.3);
  EXPECT_NEAR(exponent(scene, kGrowthMethods[1], 30, kDecades), -2, 0.3);
  EXPECT_NEAR(exponent(scene, kGrowthMethods[2], 100, {1e-4, 3e-5, 1e-5}), 0, 0.5);
}

TEST(WidthGrowth, WithShadowEdges) {
  const Scene scene = growth_scene(true);
  EXPECT_NEAR(exponent(scene, kGrowthMethods[0], 400, kDecades), -3, 0.3);
  EXPECT_NEAR(exponent(scene, kGrowthMethods[1], 30, kDecades), -2, 0.3);
  EXPECT_NEAR(exponent(scene, kGrowthMethods[2], 30, kDecades), -1, 0.3);
}

}  // namespace
}  // namespace isochron::testing
