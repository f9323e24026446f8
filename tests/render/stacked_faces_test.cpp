// Faces that lie on each other count once, under every sampling.
//
// Statistics: images against quadrature, or against images of one surface, at 4.5 standard errors of 16 or 32 replicates (by
// Student's law 4e-4 and 1e-4 each, 40 of them); derivatives likewise against finite differences with common random numbers.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/render/support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// A card that fills the image, under a point light.
Scene card_scene(const Mesh& card, bool two_sided, double albedo = 0.7) {
  Scene scene;
  scene.camera = {{0.3, 2, 0.5}, {0, 0, 0}, {0, 0, -1}, 30, 8, 8};
  PointLight light;
  light.position = {1, 1.5, -0.4};
  light.intensity = Rgb(10);
  scene.lights.push_back(light);
  add_shape(scene, "card", card, diffuse(Rgb(albedo), two_sided));
  return scene;
}

/// The image's mean, by the midpoint rule: albedo / pi x intensity x cosine / r^2 x W of the way there and back.
double expected_mean(const Scene& scene, const GateSet& gates, double albedo) {
  const CameraModel camera(scene.camera);
  constexpr int kAcross = 1500;
  double sum = 0;
  for (int i = 0; i < kAcross; ++i)
    for (int j = 0; j < kAcross; ++j) {
      const Vec3 d = camera.direction((i + 0.5) / kAcross * camera.width, (j + 0.5) / kAcross * camera.height);
      const double distance = -camera.position.y / d.y;
      const Vec3 to_light = scene.lights[0].position - (camera.position + d * distance);
      const double r = length(to_light);
      sum += to_light.y / (r * r * r) * gates.shape().value(distance + r - gates.center(0));
    }
  return albedo / kPi * scene.lights[0].intensity.r * sum / (kAcross * double{kAcross});
}

const std::vector<Vec3> kCorners{{-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}};
const Mesh kCard{kCorners, {{0, 1, 2}, {0, 2, 3}}};

void expect_mean(const Scene& scene, double albedo, const char* name) {
  for (const bool narrow : {false, true}) {
    const GateSet gates(narrow ? GateShape::gaussian(0.002) : GateShape::steady(), {narrow ? 4.0 : 0.0});
    const double expected = expected_mean(scene, gates, albedo);
    EXPECT_NEAR(expected, (narrow ? 0.63705 : 0.51867) * albedo / 0.7, 1e-4);
    for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal, Sampling::automatic}) {
      if (!narrow && sampling == Sampling::ellipsoidal) continue;  // lengths have no density there
      const bool noisy = narrow && sampling == Sampling::standard;
      const Renderer renderer(scene, gates, {.max_bounces = 1, .sampling = sampling});
      const Estimate mean = image_means(renderer, 1, noisy ? 512 : 64, 16, {test_seed(31), 0, 0})[0];
      EXPECT_LT(std::abs(mean.mean - expected), 4.5 * mean.standard_error + 1e-6)
          << name << (narrow ? ", narrow" : ", steady") << ", sampling " << static_cast<int>(sampling) << ": "
          << mean.mean << " +- " << mean.standard_error << ", expected " << expected;
      EXPECT_LT(mean.standard_error, scatter_of_errors(16) * (noisy ? 0.03 : 0.005) * expected);
    }
  }
}

TEST(StackedFaces, ACardCountsOnceHoweverOftenItIsThere) {
  expect_mean(card_scene(kCard, false), 0.7, "single");
  expect_mean(card_scene({kCorners, {{0, 1, 2}, {0, 2, 3}, {1, 2, 3}, {1, 3, 0}}}, false), 0.7, "cut both ways");
  const Mesh front_and_back{kCorners, {{0, 1, 2}, {0, 2, 3}, {3, 2, 1}, {3, 1, 0}}};
  expect_mean(card_scene(front_and_back, true), 0.7, "front and back, two-sided");
  expect_mean(card_scene(front_and_back, false), 0.7, "front and back");
  expect_mean(card_scene({kCorners, {{0, 1, 2}, {0, 2, 3}, {0, 3, 2}, {0, 2, 1}}}, false), 0.7,
              "front and back, cut alike");
}

TEST(StackedFaces, OfTwoShapesTheLaterOneIsSeen) {
  const Mesh other{{{-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}}, {{0, 1, 3}, {1, 2, 3}}};
  Scene scene = card_scene(kCard, false, 0.2);
  add_shape(scene, "over it", other, diffuse(Rgb(0.7)));
  expect_mean(scene, 0.7, "later one");
  Scene reversed = card_scene(other, false, 0.7);
  add_shape(reversed, "over it", kCard, diffuse(Rgb(0.2)));
  expect_mean(reversed, 0.2, "later one of the other order");
  // The back of a surface that faces away is not seen while another one faces the camera.
  Scene behind = card_scene(kCard, false, 0.7);
  add_shape(behind, "back", quad({-2, 0, -2}, {2, 0, -2}, {2, 0, 2}, {-2, 0, 2}), diffuse(Rgb(0.2)));
  expect_mean(behind, 0.7, "a back of its own");
}

/// Twice the same lamp, of which both are in the ceiling's plane.
TEST(StackedFaces, ALampThatIsThereTwiceShinesOnce) {
  const auto with_lamps = [](int lamps, bool ceiling) {
    Scene scene = card_scene(kCard, false);
    scene.lights.clear();
    for (int i = 0; i < lamps; ++i)
      add_shape(scene, "lamp" + std::to_string(i),
                quad({-0.3, 1, -0.8}, {0.2, 1, -0.8}, {0.2, 1, -0.4}, {-0.3, 1, -0.4}), diffuse(Rgb(0.0)), Rgb(10));
    if (ceiling)
      add_shape(scene, "ceiling", quad({-3, 1, -3}, {3, 1, -3}, {3, 1, -0.3}, {-3, 1, -0.3}), diffuse(Rgb(0.0)));
    return scene;
  };
  for (const bool narrow : {false, true}) {
    const GateSet gates(narrow ? GateShape::gaussian(0.05) : GateShape::steady(), {narrow ? 3.3 : 0.0});
    const auto mean = [&](const Scene& scene, int seed) {
      const EstimatorOptions options{.max_bounces = 1, .sampling = narrow ? Sampling::ellipsoidal : Sampling::standard};
      return image_means(Renderer(scene, gates, options), 1, 128, 32, {test_seed(seed), 0, 0})[0];
    };
    const Estimate once = mean(with_lamps(1, false), 32), twice = mean(with_lamps(2, true), 33);
    EXPECT_LT(std::abs(z_score(once, twice)), 4.5) << once.mean << ", " << twice.mean;
    EXPECT_LT(std::hypot(once.standard_error, twice.standard_error), scatter_of_errors(32) * 0.01 * once.mean);
  }
}

/// A board in the bins of a confocal capture, by area, by the wall's reflection and by both.
TEST(StackedFaces, BinsOfCapturesCountThemOnce) {
  const auto capture_of = [](const Mesh& board) {
    Scene scene;
    scene.capture.emplace();
    scene.capture->columns = 2;
    scene.capture->rows = 1;
    scene.capture->sensor = {{{-0.3, 0.25, 0}, {0, 0, 1}}, {{0.2, -0.1, 0}, {0, 0, 1}}};
    scene.camera.width = 2;
    scene.camera.height = 1;
    scene.camera.look_at = {0, 0, 1};
    add_shape(scene, "board", board, diffuse(Rgb(0.7), true));
    scene.shapes[0].hidden = true;
    return scene;
  };
  const std::vector<Vec3> corners{{-0.2, -0.25, 0.4}, {0.25, -0.25, 0.55}, {0.25, 0.2, 0.55}, {-0.2, 0.2, 0.4}};
  const Scene single = capture_of({corners, {{0, 1, 2}, {0, 2, 3}}}),
              doubled = capture_of({corners, {{0, 1, 2}, {0, 2, 3}, {3, 1, 0}, {3, 2, 1}}});
  const GateSet gates(GateShape::bin(0.1, {-0.02, 0, 0.02}, {0, 1, 0}), {1.15, 1.25});
  for (const std::optional<double> hidden : {std::optional<double>(), std::optional(0.0), std::optional(0.5)})
    for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
      const EstimatorOptions options{.max_bounces = 2, .sampling = sampling, .hidden = hidden};
      const auto one = image_means(Renderer(single, gates, options), 2, 2048, 32, {test_seed(34), 0, 0}),
                 two = image_means(Renderer(doubled, gates, options), 2, 2048, 32, {test_seed(35), 0, 0});
      for (int g = 0; g < 2; ++g) {
        EXPECT_LT(std::abs(z_score(one[g], two[g])), 4.5)
            << "hidden " << hidden.value_or(-1) << ", sampling " << static_cast<int>(sampling) << ", gate " << g << ": "
            << one[g].mean << " +- " << one[g].standard_error << ", doubled " << two[g].mean << " +- "
            << two[g].standard_error;
        EXPECT_LT(std::hypot(one[g].standard_error, two[g].standard_error), scatter_of_errors(32) * 0.03 * one[g].mean);
      }
    }
}

/// A bright patch slides over a dark floor; a wall beside them mirrors that in its own light.
TEST(StackedFaces, APatchThatSlidesOverAFloor) {
  for (const bool narrow : {false, true}) {
    Scene scene;
    scene.camera = {{0.4, 1.5, 3}, {0, 0.2, 0}, {0, 1, 0}, 40, 10, 10};
    add_shape(scene, "floor", quad({-1.5, 0, 1.5}, {1.5, 0, 1.5}, {1.5, 0, -1}, {-1.5, 0, -1}), diffuse(Rgb(0.2)));
    add_shape(scene, "back", quad({-1.5, 0, -1}, {1.5, 0, -1}, {1.5, 1.5, -1}, {-1.5, 1.5, -1}), diffuse(Rgb(0.6)));
    add_shape(scene, "lamp", quad({-0.4, 2, -0.4}, {0.4, 2, -0.4}, {0.4, 2, 0.4}, {-0.4, 2, 0.4}), diffuse(Rgb(0.0)),
              Rgb(15.0));
    add_shape(scene, "patch", quad({-0.4, 0, 0.1}, {0.3, 0, 0.3}, {0.4, 0, -0.5}, {-0.3, 0, -0.6}), diffuse(Rgb(0.9)));
    const Motion motion = translate(scene, "patch", {0.3, 0, -1});
    const TangentBasis basis = make_basis(scene, {motion});
    const GateSet gates(narrow ? GateShape::gaussian(0.2) : GateShape::steady(), {narrow ? 5.5 : 0.0});
    const EstimatorOptions plain{.max_bounces = 2, .sampling = Sampling::standard};
    EstimatorOptions options = plain;
    options.sampling = narrow ? Sampling::ellipsoidal : Sampling::standard;
    options.guiding_samples = 16;
    const Renderer renderer(scene, gates, options, &basis);
    constexpr int kReplicates = 16, kSamples = 256;
    const Estimate total = replicated(
        kReplicates, test_seed(36), [&](const Stream& stream) { return total_derivative(renderer, kSamples, stream); });
    const auto reference = [&](const Stream& stream) {
      return finite_difference(scene, motion, 0.005, gates, plain, 1024, 2, stream)[0].mean;
    };
    const Estimate difference = replicated(kReplicates, test_seed(37), reference);
    EXPECT_LT(std::abs(z_score(total, difference)), 4.5)
        << (narrow ? "gated: " : "steady: ") << total.mean << " +- " << total.standard_error << ", finite difference "
        << difference.mean << " +- " << difference.standard_error;
    EXPECT_LT(std::hypot(total.standard_error, difference.standard_error),
              scatter_of_errors(kReplicates) * 0.08 * std::abs(difference.mean));
  }
}

}  // namespace
}  // namespace isochron::testing
