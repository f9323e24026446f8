// Trials tell what standard sampling and connections cost: against images rendered by each.
//
// Statistics: both are variances from 64 batches of 256 pixels. Over 8 seeds their ratio has a standard deviation of 0.02 to 0.05;
// the tolerance is five of the largest (false alarms: 6e-7 each, 5e-6 for the file).
#include "core/render/technique_trial.h"

#include <gtest/gtest.h>

#include "core/render/renderer.h"
#include "tests/render/pixel_statistics.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

struct TrialCase {
  const char* name;
  bool derivative;
  double light;
  int block;
};
void PrintTo(const TrialCase& c, std::ostream* out) {
  *out << c.name;
}

class TechniqueTrials : public ::testing::TestWithParam<TrialCase> {};

TEST_P(TechniqueTrials, TellWhatEachCosts) {
  constexpr int kBatches = 64, kSamples = 4;
  const auto [name, derivative, light, block] = GetParam();
  const Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  const GateSet gates(GateShape::gaussian(0.3), {5.0, 6.0});
  const TangentBasis basis = make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3})});
  EstimatorOptions options{.max_bounces = 3, .numbers = Numbers::independent, .keep_length = false, .light = light};
  SceneCache cache(scene, CasterUpdate::rebuild);
  for (const bool connections : {false, true}) {
    const TechniqueTrial trial{scene, gates, options, derivative ? &basis : nullptr, block, kSamples};
    const TrialBatches found = run_trial(trial, connections, kBatches, 1e12, {1, 2, 3}, cache);
    EXPECT_EQ(found.count, kBatches);
    EXPECT_FALSE(found.has_others);
    options.mix = SamplingMix{connections, connections};
    const Renderer renderer(scene, gates, options, &basis);
    PixelBatches images;
    for (int b = 0; b < kBatches; ++b) {
      const SampleRange range{b * kSamples, (b + 1) * kSamples};
      const GatedImage image =
          derivative ? renderer.derive(Term::interior, {4, 5, 6}, range)[0] : renderer.render({4, 5, 6}, range);
      images.add(block == 1 ? image : blocks(image, block));
    }
    double variance = 0;
    for (std::size_t i = 0; i < images.mean().data.size(); ++i) variance += images.variance(i) * kBatches;
    const double sums = double{1} * block * block * block * block;  // blocks() averages
    EXPECT_NEAR(found.variance * found.work / (variance * sums * renderer.work() / kBatches), 1, 0.25) << connections;
    // As many batches as the work allows, but at least one.
    EXPECT_EQ(run_trial(trial, connections, kBatches, 3.5 * found.work, {1, 2, 3}, cache).count, 3);
    EXPECT_EQ(run_trial(trial, connections, kBatches, 0, {1, 2, 3}, cache).count, 1);
  }
}

/// Connections end outside of glass, and on a surface whose last segments are both outside where the light has no extent.
TEST(TechniqueTrial, SaysThatThereAreOtherPaths) {
  const auto has_others = [](const Scene& scene) {
    const GateSet gates(GateShape::gaussian(0.6), {5.0});
    SceneCache cache(scene, CasterUpdate::rebuild);
    const TechniqueTrial trial{scene, gates, {.max_bounces = 3}, nullptr, 1, 4};
    return run_trial(trial, false, 2, 1e12, {1, 2, 3}, cache).has_others;
  };
  Scene scene = glossy_validation_scene(16, 0.5, glass(0.3, 1.5));
  EXPECT_FALSE(has_others(scene));
  EXPECT_TRUE(has_others(scene_with_light_in_glass()));
  scene.lights.push_back({.name = "outside", .position = scene.camera.position, .intensity = Rgb(1)});
  EXPECT_TRUE(has_others(scene));
}

INSTANTIATE_TEST_SUITE_P(Of, TechniqueTrials,
                         ::testing::Values(TrialCase{"images", false, 0, 1},
                                           TrialCase{"images_with_light", false, 0.5, 1},
                                           TrialCase{"derivatives", true, 0, 1},
                                           TrialCase{"sums_of_images", false, 0.5, 4}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace isochron::testing
