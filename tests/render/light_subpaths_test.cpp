// Light subpaths: combined with standard sampling, and with ellipsoidal connections, they give what these alone give, in
// images and in derivatives; and they are used where light leaves its case by a slit.
//
// Statistics: z-tests at 4.5 standard errors of the difference (false alarms: 7e-6 each, below 2e-3 for the file), fixed seeds.
// Standard errors are below 1 % of the image and 2 % of the derivatives' scale, 10 % by the block's motion: what lacks 14 % of the
// former fails. How paths are shared has a test without noise (weights_test.cpp).
#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/render/measure_mix.h"
#include "tests/render/pixel_statistics.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

struct LightCase {
  const char* name;
  bool connections;
  GateShape gate;
  int samples;  ///< of derivatives, per batch; twice as many without light subpaths
};
void PrintTo(const LightCase& c, std::ostream* out) {
  *out << c.name;
}

EstimatorOptions with_light(int bounces, bool connections, double light) {
  EstimatorOptions options{.max_bounces = bounces};
  options.mix = SamplingMix{connections, connections};
  options.light = light;
  return options;
}

void expect_equal_images(const Scene& scene, const GateSet& gates, const EstimatorOptions& options, int samples = 16) {
  constexpr int kBatches = 32;
  EstimatorOptions plain = options;
  plain.sampling = Sampling::standard;
  plain.light.reset();
  const auto expected =
      image_means(Renderer(scene, gates, plain, nullptr), gates.size(), 2 * samples, kBatches, {51, 0, 0});
  const auto found = image_means(Renderer(scene, gates, options, nullptr), gates.size(), samples, kBatches, {52, 0, 0});
  for (int g = 0; g < gates.size(); ++g) {
    EXPECT_LT(std::abs(z_score(found[g], expected[g])), 4.5)
        << "gate " << g << ": " << found[g].mean << " +- " << found[g].standard_error << ", standard "
        << expected[g].mean << " +- " << expected[g].standard_error;
    EXPECT_LT(std::hypot(found[g].standard_error, expected[g].standard_error),
              scatter_of_errors(kBatches) * 0.01 * expected[g].mean);
  }
}

class LightSubpathsIn : public ::testing::TestWithParam<LightCase> {};

TEST_P(LightSubpathsIn, ImagesAndDerivativesAreThoseOfStandardSampling) {
  const auto& [name, connections, shape, samples] = GetParam();
  const Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  const GateSet gates(shape, {5.0, 6.5});
  const EstimatorOptions ours = with_light(3, connections, 0.6);
  expect_equal_images(scene, gates, ours);
  const TangentBasis basis =
      make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3}), change_material(scene, "panel", "roughness"),
                         translate(scene, "block", {0.3, 1, 0.2})});
  constexpr int kBatches = 32;
  EstimatorOptions plain = ours;
  plain.sampling = shape.pair_mass(PairPart::dirac) > 0 ? Sampling::ellipsoidal : Sampling::standard;
  plain.light.reset();
  const Renderer reference(scene, gates, plain, &basis), with_light_subpaths(scene, gates, ours, &basis);
  for (const Term term : {Term::interior, Term::path_length}) {
    if (!reference.has(term)) continue;
    const auto expected = term_means(reference, term, 3, 2, 2 * samples, kBatches, {53, 0, 0});
    const auto found = term_means(with_light_subpaths, term, 3, 2, samples, kBatches, {54, 0, 0});
    for (int m = 0; m < 3; ++m) {
      const double scale = std::hypot(expected[m][0].mean, expected[m][1].mean);
      for (int g = 0; g < 2; ++g) {
        EXPECT_LT(std::abs(z_score(found[m][g], expected[m][g])), 4.5)
            << ::isochron::name(term) << " motion " << m << " gate " << g << ": " << found[m][g].mean << " +- "
            << found[m][g].standard_error << ", without " << expected[m][g].mean << " +- "
            << expected[m][g].standard_error;
        EXPECT_LE(std::hypot(found[m][g].standard_error, expected[m][g].standard_error),
                  scatter_of_errors(kBatches) * (m < 2 ? 0.02 : 0.1) * scale)
            << ::isochron::name(term) << " motion " << m << " gate " << g;
      }
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Mixes, LightSubpathsIn,
                         ::testing::Values(LightCase{"standard", false, GateShape::gaussian(1.2), 24},
                                           LightCase{"connections", true, GateShape::gaussian(0.4), 24},
                                           LightCase{"jumps", true, GateShape::boxcar(0.5), 60},
                                           LightCase{"boxcar", false, GateShape::boxcar(1.5), 30}),
                         [](const auto& test) { return std::string(test.param.name); });

TEST(LightSubpaths, LeaveGlassInTheDirectionsOfImportance) {
  expect_equal_images(glossy_validation_scene(16, 0.5, glass(0.3, 1.5)), GateSet(GateShape::gaussian(1.5), {5.0, 7.0}),
                      with_light(4, false, 0.5), 128);
}

TEST(LightSubpaths, OfLightsWithoutAnExtent) {
  Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  PointLight point{.name = "point", .position = {0.3, 0.4, 0.2}, .intensity = Rgb(0.5)};
  PointLight spot{.name = "spot",
                  .kind = PointLight::Kind::spot,
                  .position = {-0.3, 0.8, 0.5},
                  .direction = normalize(Vec3{0.2, -1, -0.3}),
                  .intensity = Rgb(4)};
  scene.lights = {point, spot};
  expect_equal_images(scene, GateSet(GateShape::gaussian(1.5), {3.0, 5.0}), with_light(3, false, 0.5));
}

TEST(LightSubpaths, AreTakenWhereTheyHelp) {
  const auto settled = [](const Scene& scene, const GateSet& gates) {
    EstimatorOptions options{.max_bounces = 4};
    options.mix = measure_mix(scene, gates, options, nullptr, {3, 0, 0}, Purpose::images);
    return options;
  };
  Scene cove = load_scene(PROJECT_ROOT "/scenes/cove/scene.yaml");
  cove.camera.width = cove.camera.height = 16;
  const GateSet wide(GateShape::gaussian(0.6), {6.5, 8});
  const EstimatorOptions with = settled(cove, wide);
  EXPECT_GT(with.mix->image_light, 0);
  // Pixel by pixel, for the same work.
  double cost[2];
  for (const bool light : {false, true}) {
    EstimatorOptions options = with;
    if (!light) options.light = 0;
    const Renderer renderer(cove, wide, options);
    PixelBatches pixels;
    for (int b = 0; b < 16; ++b) pixels.add(renderer.render({4, 0, 0}, {b * 32, (b + 1) * 32}));
    cost[light] = pixels.mean_variance() * renderer.work();
  }
  EXPECT_LT(cost[1], 0.3 * cost[0]);
  Scene box = load_scene(TEST_DATA "/cornell/scene.yaml");
  box.camera.width = box.camera.height = 16;
  EXPECT_EQ(settled(box, GateSet(GateShape::steady(), {0})).mix->image_light, 0);
}

/// Under gates wide enough for standard sampling, where a trial of connections would take more than the job allows.
TEST(LightSubpaths, AreTakenWhereConnectionsAreTooDearToTry) {
  Scene cove = load_scene(PROJECT_ROOT "/scenes/cove/scene.yaml");
  cove.camera.width = cove.camera.height = 64;
  const GateSet gates(GateShape::boxcar(0.75), {5.0, 5.75, 6.5, 7.25, 8.0, 8.75});
  for (const unsigned seed : {1, 2, 3}) {
    double work = 0;
    EstimatorOptions options{.max_bounces = 6};
    options.mix = measure_mix(cove, gates, options, nullptr, {seed, 0, 0}, Purpose::images, {256, 0}, &work);
    EXPECT_FALSE(options.mix->image_connections) << seed;
    EXPECT_GT(options.mix->image_light, 0) << seed;
    const Renderer renderer(cove, gates, options);
    renderer.render({2, 0, 0}, {0, 256});
    EXPECT_LT(work, 0.11 * renderer.work()) << seed;
  }
}

/// They lower the variance of the interior term. Where the visibility term makes nearly all of it, having few samples, they only cost. Of
/// 48 trials one misses what they bring, so that two of three do with a seed in a thousand.
TEST(LightSubpaths, AreTakenWhereTheTermThatTheyHelpDecides) {
  Scene cove = load_scene(PROJECT_ROOT "/scenes/cove/scene.yaml");
  cove.camera.width = cove.camera.height = 32;
  const GateSet wide(GateShape::gaussian(0.6), {6.5, 8});
  const TangentBasis basis = make_basis(cove, {translate(cove, "lamp", {0, 1, 0})});
  int taken = 0;
  for (const unsigned seed : {1, 2, 3}) {
    const auto light = [&](double visibility) {
      const Job job{.image = 0, .interior = 8192, .visibility = visibility, .path_length = 0};
      const EstimatorOptions options{.max_bounces = 4, .guiding_samples = 4};
      return measure_mix(cove, wide, options, &basis, {seed, 0, 0}, Purpose::gradients, job).interior_light;
    };
    taken += light(1) > 0;
    EXPECT_EQ(light(1e-5), 0) << seed;
  }
  EXPECT_GE(taken, 2);
}

/// Few samples by standard sampling may find next to nothing of the light that those with light subpaths do. Over 8 seeds all of 192 trials
/// choose these; of trials that trust the variance that they see 13 to 19 of 24.
TEST(LightSubpaths, AreTakenWhereStandardSamplingLooksQuiet) {
  Scene cove = load_scene(PROJECT_ROOT "/scenes/cove/scene.yaml");
  cove.camera.width = cove.camera.height = 32;
  const GateSet late(GateShape::gaussian(1.4), {9.0});
  const TangentBasis basis = make_basis(cove, {translate(cove, "lamp", {0, 1, 0})});
  int taken = 0;
  for (unsigned seed = 1; seed <= 24; ++seed) {
    const Job job{.image = 0, .interior = 200, .visibility = 0, .path_length = 0};
    taken +=
        measure_mix(cove, late, {.max_bounces = 6}, &basis, {seed, 0, 0}, Purpose::gradients, job).interior_light > 0;
  }
  EXPECT_GE(taken, 22);
}

TEST(LightSubpaths, AreRefusedInCaptures) {
  Scene scene;
  scene.capture.emplace();
  scene.capture->columns = scene.capture->rows = scene.camera.width = scene.camera.height = 1;
  scene.capture->sensor = {{{0, 0, 0}, {0, 0, 1}}};
  scene.camera.look_at = {0, 0, 1};
  add_shape(scene, "board", quad({-1, -1, 1}, {-1, 1, 1}, {1, 1, 1}, {1, -1, 1}), diffuse(Rgb(0.5)));
  EXPECT_THROW(Renderer(scene, GateSet(GateShape::gaussian(0.1), {2.0}), {.light = 0.5}, nullptr), InputError);
}

}  // namespace
}  // namespace isochron::testing
