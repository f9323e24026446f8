// Every technique against every other: images, derivatives of what moves in them, and of shadow edges, by each set of techniques that
// finds all paths, agree in pairs.
//
// Statistics: z-tests at 4 standard errors of the difference (false alarms: 6e-5 each, 3e-3 for the file), which is below 2 % of what is
// compared.
#include <gtest/gtest.h>

#include "support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

struct BySet {
  std::string name;
  Estimate estimate;
};

void expect_pairs_agree(const std::string& what, const std::vector<BySet>& found) {
  for (std::size_t i = 0; i < found.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) {
      const Estimate &a = found[i].estimate, &b = found[j].estimate;
      const std::string pair = what + ": " + found[i].name + ", " + found[j].name;
      EXPECT_LT(std::abs(z_score(a, b)), 4)
          << pair << ": " << a.mean << " +- " << a.standard_error << ", " << b.mean << " +- " << b.standard_error;
      EXPECT_LT(std::hypot(a.standard_error, b.standard_error), 0.02 * std::abs(b.mean)) << pair;
    }
}

struct PathSet {
  const char* name;
  bool connections;
  double light;
  int samples;  ///< of the derivative, per batch; a third of them for images
};

class TechniquePairs : public ::testing::TestWithParam<bool> {};

TEST_P(TechniquePairs, OfPathsAgree) {
  constexpr int kBatches = 24;
  constexpr PathSet kSets[] = {{"standard sampling", false, 0, 40},
                               {"light subpaths", false, 0.9, 40},
                               {"connections", true, 0, 40},
                               {"connections with light subpaths", true, 0.9, 40}};
  const Scene scene = glossy_validation_scene(16, 0.5, diffuse(Rgb(0.6)));
  const TangentBasis basis = make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3})});
  const GateSet gates(GateShape::gaussian(GetParam() ? 0.3 : 1.2), {5.5});
  std::vector<BySet> images, derivatives;
  std::uint32_t seed = 60;
  for (const PathSet& set : kSets) {
    EstimatorOptions options{.max_bounces = 3};
    options.mix = SamplingMix{set.connections, set.connections};
    options.light = set.light;
    const Renderer renderer(scene, gates, options, &basis);
    images.push_back({set.name, image_means(renderer, 1, set.samples / 3, kBatches, {test_seed(seed++), 0, 0})[0]});
    derivatives.push_back(
        {set.name, term_means(renderer, Term::interior, 1, 1, set.samples, kBatches, {test_seed(seed++), 0, 0})[0][0]});
  }
  expect_pairs_agree("image", images);
  expect_pairs_agree("interior derivative", derivatives);
}

/// A board between a lamp and the floor that the camera sees, with a wall that returns light.
Scene shaded_floor() {
  Scene scene;
  scene.camera.width = scene.camera.height = 8;
  scene.camera.position = {0, 1.6, 2.5};
  scene.camera.look_at = {0, 0, 0};
  add_shape(scene, "floor", quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), diffuse(Rgb(0.7)));
  add_shape(scene, "wall", quad({-2, 0, -2}, {2, 0, -2}, {2, 3, -2}, {-2, 3, -2}), diffuse(Rgb(0.5)));
  add_shape(scene, "lamp", quad({-0.3, 2, -0.3}, {0.3, 2, -0.3}, {0.3, 2, 0.3}, {-0.3, 2, 0.3}), diffuse(Rgb(0.2)),
            Rgb(10));
  add_shape(scene, "board", quad({-0.8, 1.2, 0.3}, {0.2, 1.2, 0.3}, {0.2, 1.2, -0.3}, {-0.8, 1.2, -0.3}),
            diffuse(Rgb(0.4), true));
  return scene;
}

struct SegmentSet {
  const char* name;
  BoundaryTechniques techniques;
  int samples;  ///< per batch
};

TEST_P(TechniquePairs, OfBoundarySegmentsAgree) {
  constexpr int kBatches = 32;
  const bool narrow = GetParam();
  std::vector<SegmentSet> sets = {{"edges", {false, false, false, false, false}, narrow ? 3072 : 1536},
                                  {"edges by wedges", {true, false, false, false, false}, narrow ? 3072 : 1536},
                                  {"edges, aimed", {false, true, false, false, false}, narrow ? 256 : 64},
                                  {"walks", {false, false, true, false, false}, narrow ? 1024 : 384}};
  if (narrow) {
    sets.push_back({"walks at lengths", {false, false, true, true, false}, 1024});
    sets.push_back({"light by arcs", {false, true, false, false, true}, 256});
  }
  const Scene scene = shaded_floor();
  const TangentBasis basis = make_basis(scene, {translate(scene, "board", {1, 0.2, 0})});
  const GateSet gates(GateShape::gaussian(narrow ? 0.2 : 0.8), {4.9});
  std::vector<BySet> derivatives;
  std::uint32_t seed = 80;
  for (const SegmentSet& set : sets) {
    EstimatorOptions options{.max_bounces = 2, .sampling = narrow ? Sampling::ellipsoidal : Sampling::standard};
    options.boundary = set.techniques;
    derivatives.push_back({set.name, term_means(Renderer(scene, gates, options, &basis), Term::visibility, 1, 1,
                                                set.samples, kBatches, {test_seed(seed++), 0, 0})[0][0]});
  }
  expect_pairs_agree("visibility derivative", derivatives);
}

/// Two boards behind a wall's points that light each other; apart, as derivatives are heavy-tailed where surfaces meet.
Scene captured_corner(bool confocal) {
  Scene scene;
  scene.capture.emplace();
  Capture& capture = *scene.capture;
  capture.columns = 4;
  capture.rows = 1;
  const Vec3 normal{0, 0, 1};
  for (const double x : {-0.25, -0.1, 0.05, 0.2}) capture.sensor.push_back({{x, 0.1 + x / 2, 0}, normal});
  if (!confocal) capture.spots = {{{0.1, -0.1, 0}, normal}};
  scene.camera.width = 4;
  scene.camera.height = 1;
  scene.camera.look_at = normal;
  add_shape(scene, "left", quad({-0.4, -0.3, 0.35}, {-0.4, 0.3, 0.35}, {-0.1, 0.3, 0.6}, {-0.1, -0.3, 0.6}),
            diffuse(Rgb(0.9), true));
  add_shape(scene, "right", quad({0.1, -0.3, 0.6}, {0.1, 0.3, 0.6}, {0.4, 0.3, 0.35}, {0.4, -0.3, 0.35}),
            diffuse(Rgb(0.9), true));
  scene.shapes[0].hidden = true;
  return scene;
}

/// Of captures, when most light of one bounce has come.
TEST(TechniquePairsOfCaptures, OfTwoBouncesAgree) {
  constexpr int kBatches = 48, kSamples = 4096;
  const GateSet gates(GateShape::gaussian(0.06), {1.56});
  std::uint32_t seed = 120;
  for (const bool confocal : {true, false}) {
    const Scene scene = captured_corner(confocal);
    const TangentBasis basis = make_basis(scene, {translate(scene, "left", {1, 0, 0.2})});
    std::vector<BySet> images, derivatives;
    for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
      const EstimatorOptions options{.max_bounces = 2, .sampling = sampling, .keep_length = false};
      const char* name = sampling == Sampling::standard ? "standard sampling" : "connections";
      const Renderer renderer(scene, gates, options, &basis);
      images.push_back({name, image_means(renderer, 1, kSamples, kBatches, {test_seed(seed++), 0, 0})[0]});
      derivatives.push_back(
          {name, term_means(renderer, Term::interior, 1, 1, kSamples, kBatches, {test_seed(seed++), 0, 0})[0][0]});
    }
    const EstimatorOptions single{.max_bounces = 1};
    EXPECT_LT(image_means(Renderer(scene, gates, single), 1, kSamples, 8, {test_seed(seed++), 0, 0})[0].mean,
              0.4 * images[0].estimate.mean);
    expect_pairs_agree(confocal ? "confocal image" : "image by one spot", images);
    expect_pairs_agree(confocal ? "confocal derivative" : "derivative by one spot", derivatives);
  }
}

INSTANTIATE_TEST_SUITE_P(Gates, TechniquePairs, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "narrow" : "wide"; });

}  // namespace
}  // namespace isochron::testing
