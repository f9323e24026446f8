// Trials tell what standard sampling and connections cost: the variance and work of images and derivatives that are rendered by
// each, with the same random numbers.
#include "core/render/technique_trial.h"

#include <gtest/gtest.h>

#include <optional>

#include "core/render/renderer.h"
#include "tests/render/pixel_statistics.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

struct TrialCase {
  const char* name;
  std::optional<Term> term;  ///< none: images
  double light;
  int block;
};
void PrintTo(const TrialCase& c, std::ostream* out) {
  *out << c.name;
}

class TechniqueTrials : public ::testing::TestWithParam<TrialCase> {};

TEST_P(TechniqueTrials, TellWhatEachCosts) {
  constexpr int kBatches = 8, kSamples = 4;
  const auto [name, term, light, block] = GetParam();
  const Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  // Jumps belong to a term of their own.
  const GateSet gates(term == Term::path_length ? GateShape::boxcar(0.6) : GateShape::gaussian(0.3), {5.0, 6.0});
  const TangentBasis basis = make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3})});
  EstimatorOptions options{.max_bounces = 3, .numbers = Numbers::independent, .keep_length = false};
  SceneCache cache(scene, CasterUpdate::rebuild);
  for (const bool connections : {false, true}) {
    const TechniqueTrial trial{scene, gates, options, term ? &basis : nullptr, block, kSamples};
    const TrialBatches found =
        run_trial(trial, {connections, light}, term.value_or(Term::interior), kBatches, {1, 2, 3}, cache);
    EXPECT_EQ(found.count, kBatches);
    EXPECT_FALSE(found.has_others);
    options.mix = SamplingMix{connections, connections, light, light};
    const Renderer renderer(scene, gates, options, &basis);
    PixelBatches images;
    for (int b = 0; b < kBatches; ++b) {
      const SampleRange range{b * kSamples, (b + 1) * kSamples};
      const GatedImage image = term ? renderer.derive(*term, {1, 2, 3}, range)[0] : renderer.render({1, 2, 3}, range);
      images.add(block == 1 ? image : blocks(image, block));
    }
    double variance = 0;
    for (std::size_t i = 0; i < images.mean().data.size(); ++i) variance += images.variance(i) * kBatches;
    const double sums = double{1} * block * block * block * block;  // blocks() averages
    EXPECT_NEAR(found.variance / (variance * sums * kSamples), 1, 1e-9) << connections;
    EXPECT_NEAR(found.work / (renderer.work() / (kBatches * kSamples)), 1, 1e-9) << connections;
  }
}

/// Against the moments of a trial without light subpaths. Over 8 seeds their ratio has a standard deviation of 0.02; the tolerance is
/// five times as much.
TEST(TechniqueTrial, PredictsMomentsWithoutLightSubpaths) {
  const Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  const GateSet gates(GateShape::gaussian(0.6), {5.0, 6.0});
  SceneCache cache(scene, CasterUpdate::rebuild);
  const TangentBasis basis = make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3})});
  for (const TangentBasis* column : {static_cast<const TangentBasis*>(nullptr), &basis}) {
    const TechniqueTrial trial{scene, gates, {.max_bounces = 3}, column, 1, 64};
    const TrialBatches with = run_trial(trial, {false, 0.5}, Term::interior, 4, {1, 2, 3}, cache);
    const TrialBatches without = run_trial(trial, {false, 0}, Term::interior, 4, {1, 2, 4}, cache);
    ASSERT_GT(without.moment, 0);
    EXPECT_NEAR(with.moment_without_light / without.moment, 1, 0.1);
  }
}

/// Connections end outside of glass, and on a surface whose last segments are both outside where the light has no extent.
TEST(TechniqueTrial, SaysThatThereAreOtherPaths) {
  const auto has_others = [](const Scene& scene) {
    const GateSet gates(GateShape::gaussian(0.6), {5.0});
    SceneCache cache(scene, CasterUpdate::rebuild);
    const TechniqueTrial trial{scene, gates, {.max_bounces = 3}, nullptr, 1, 4};
    return run_trial(trial, {}, Term::interior, 2, {1, 2, 3}, cache).has_others;
  };
  Scene scene = glossy_validation_scene(16, 0.5, glass(0.3, 1.5));
  EXPECT_FALSE(has_others(scene));
  EXPECT_TRUE(has_others(scene_with_light_in_glass()));
  scene.lights.push_back({.name = "outside", .position = scene.camera.position, .intensity = Rgb(1)});
  EXPECT_TRUE(has_others(scene));
}

INSTANTIATE_TEST_SUITE_P(Of, TechniqueTrials,
                         ::testing::Values(TrialCase{"images", {}, 0, 1}, TrialCase{"images_with_light", {}, 0.5, 1},
                                           TrialCase{"derivatives", Term::interior, 0, 1},
                                           TrialCase{"jumps", Term::path_length, 0, 1},
                                           TrialCase{"boundaries", Term::visibility, 0, 4},
                                           TrialCase{"sums_of_images", {}, 0.5, 4}),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace isochron::testing
