// Derivatives do not depend on how far what the camera sees follows what moves close to it (VertexFlows), but their
// variance does.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/paths/vertex_flow.h"
#include "core/techniques/secondary_boundary.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

/// Two estimates of the same values, more than `least` of which are not zero: median of their squared z-scores
/// below `most`, root mean square error below `error` times that of the second one's values. The median, since rare large
/// samples that few batches of a pixel have, and others do not, make z-scores with heavy tails.
void expect_same(const std::vector<Batches>& one, const std::vector<Batches>& other, int least, double most,
                 double error) {
  std::vector<double> squares;
  double difference = 0, scale = 0;
  int count = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    const Estimate a = one[i].estimate(), b = other[i].estimate();
    if (a.standard_error == 0 && b.standard_error == 0) continue;
    squares.push_back(std::pow(z_score(a, b), 2));
    difference += std::pow(std::hypot(a.standard_error, b.standard_error), 2);
    scale += b.mean * b.mean;
    ++count;
  }
  ASSERT_GT(count, least);
  const auto middle = squares.begin() + count / 2;
  std::nth_element(squares.begin(), middle, squares.end());
  EXPECT_LT(*middle, most) << count << " values";
  EXPECT_LT(std::sqrt(difference / scale), error);
  ::testing::Test::RecordProperty("median_square_z", std::to_string(*middle));
  ::testing::Test::RecordProperty("error_over_scale", std::to_string(std::sqrt(difference / scale)));
}

struct FlowCase {
  const char* name;
  bool glass;
  GateShape shape;
  Sampling sampling;
  double radius, reference_radius;
  int samples;  ///< per batch
};
void PrintTo(const FlowCase& c, std::ostream* out) {
  *out << c.name;
}

class CameraFlowOfEveryPixel : public ::testing::TestWithParam<FlowCase> {};

/// Two radii give the same derivative in every pixel. Median of squared z-scores over 64 pixels, 2 gates and 3
/// motions (of which one third or so see something): of normal ones, with 32 batches, it is 0.47 and, the
/// motions being correlated, its standard deviation at most 0.13. Samples are skewed, so that batches know their errors too well:
/// 0.44 to 0.91 over six sets of random numbers, mean 0.63, standard deviation 0.14. The limit of 1.06: false alarms 1e-3.
TEST_P(CameraFlowOfEveryPixel, GivesTheSameDerivative) {
  const FlowCase& c = GetParam();
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 8;
  if (c.glass) replace_material(scene, "block", glass(0.3, 1.5));
  const std::vector<Motion> motions = {translate(scene, "block", {0.3, 1, 0.2}),
                                       rotate_y(scene, "block", {-0.9, -0.4, -0.6}),
                                       translate(scene, "panel", {-1, 0.2, 0.1})};
  const TangentBasis basis = make_basis(scene, motions);
  const GateSet gates(c.shape, {5.0, 6.0});
  constexpr int kBatches = 32;
  const auto estimate = [&](double radius) {
    EstimatorOptions options;
    options.max_bounces = 3;
    options.sampling = c.sampling;
    options.guiding_samples = 16;
    options.follow_radius = radius;
    const Renderer renderer(scene, gates, options, &basis);
    std::vector<Batches> pixels(motions.size() * scene.camera.width * scene.camera.height * gates.size());
    for (int b = 0; b < kBatches; ++b) {
      std::vector<double> total(pixels.size(), 0.0);
      for (const Term term : kTerms) {
        const Stream stream{41, static_cast<std::uint32_t>(term), static_cast<std::uint32_t>(radius)};
        const int samples = samples_of(term, c.samples);
        const auto images = renderer.derive(term, stream, {b * samples, (b + 1) * samples});
        std::size_t i = 0;
        for (const GatedImage& image : images)
          for (const double x : image.data) total[i++] += x;
      }
      for (std::size_t i = 0; i < total.size(); ++i) pixels[i].add(total[i]);
    }
    return pixels;
  };
  const auto one = estimate(c.radius), other = estimate(c.reference_radius);
  expect_same(one, other, 100, 1.06, c.glass ? 0.8 : 0.3);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, CameraFlowOfEveryPixel,
    ::testing::Values(FlowCase{"everything_follows", false, GateShape::gaussian(0.3), Sampling::standard, 1000, 0, 48},
                      FlowCase{"a_few_pixels_boxcar_ellipsoidal", false, GateShape::boxcar(0.6), Sampling::ellipsoidal,
                               6, 0, 24},
                      FlowCase{"glass", true, GateShape::gaussian(0.3), Sampling::standard, 4, 16, 48}),
    [](const auto& test) { return test.param.name; });

/// A moving corner of two faces, bright, under a lamp that looks away from the camera.
Scene moving_corner() {
  Scene scene;
  scene.camera = {{0, 1, 3}, {0, 0, 0}, {0, 1, 0}, 40, 8, 8};
  Mesh corner = quad({-1, 0, -1}, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1});
  corner.positions.push_back({-1, 1, -1});
  corner.positions.push_back({1, 1, -1});
  corner.faces.push_back({0, 3, 5});
  corner.faces.push_back({0, 5, 4});
  add_shape(scene, "corner", corner, diffuse(Rgb(0.7)));
  add_shape(scene, "lamp", quad({-0.3, 2, -0.3}, {0.3, 2, -0.3}, {0.3, 2, 0.3}, {-0.3, 2, 0.3}), diffuse(Rgb(0)),
            Rgb(10));
  return scene;
}

/// The same with a board that hides parts of the corner from the camera and from each other.
Scene corner_with_board() {
  Scene scene = moving_corner();
  add_shape(scene, "board", quad({-0.3, 0.1, -0.6}, {0.3, 0.1, -0.3}, {0.3, 0.5, -0.3}, {-0.3, 0.5, -0.6}),
            diffuse(Rgb(0.1), true));
  return scene;
}

/// Against finite differences in every pixel: a static board in the corner hides parts of it from the camera
/// and from each other. Most follows, so that what the camera sees beside the board's edges flows across
/// them. Median of squared z-scores over 64 pixels: 0.47 expected, standard deviation 0.14; limit 1.06,
/// false-alarm rate below 1e-4.
TEST(CameraFlow, AgreesWithFiniteDifferencesBehindStaticEdges) {
  const Scene scene = corner_with_board();
  const Motion motion = translate(scene, "corner", {0.5, 1, 1});
  const TangentBasis basis = make_basis(scene, {motion});
  const GateSet gates(GateShape::steady(), {0.0});
  const EstimatorOptions options{
      .max_bounces = 2, .sampling = Sampling::standard, .follow_radius = 8, .guiding_samples = 16};
  constexpr double kStep = 0.01;
  Scene moved[2] = {scene, scene};
  for (const int side : {0, 1}) motion.apply(moved[side], side ? kStep : -kStep);
  const Renderer renderer(scene, gates, options, &basis), below(moved[0], gates, options),
      above(moved[1], gates, options);
  constexpr int kBatches = 32, kSamples = 384, kReferenceSamples = 1024;
  std::vector<Batches> ours(64), reference(64);
  for (std::uint32_t b = 0; b < kBatches; ++b) {
    std::vector<double> total(64, 0.0);
    for (const Term term : {Term::interior, Term::visibility}) {
      const Stream stream{7, b, static_cast<std::uint32_t>(term)};
      const auto image = renderer.derive(term, stream, {0, samples_of(term, kSamples)})[0];
      for (int i = 0; i < 64; ++i) total[i] += image.data[i];
    }
    const GatedImage plus = above.render({8, b, 0}, {0, kReferenceSamples}),
                     minus = below.render({8, b, 0}, {0, kReferenceSamples});
    for (int i = 0; i < 64; ++i) {
      ours[i].add(total[i]);
      reference[i].add((plus.data[i] - minus.data[i]) / (2 * kStep));
    }
  }
  expect_same(ours, reference, 32, 1.06, 0.04);
}

/// Takes the velocities of boundary segments, everything being moved along (0.3, 1, 0.5).
struct VelocitySink final : Sink {
  double velocity = 0, largest = 0;
  int segments = 0;
  bool differential() const override { return true; }
  void bind(const LocalDifferential& differential) override {
    velocity = 0;
    for (const VertexGradient& g : differential.vertices) velocity += dot(g.log_f, Vec3{0.3, 1, 0.5});
  }
  void add(int, const Rgb&, double, GateUse) override {
    largest = std::max(largest, std::abs(velocity));
    ++segments;
  }
};

/// Where all move alike and x1 follows entirely, no edge moves relative to the light that grazes it.
TEST(CameraFlow, ShadowsMoveWithEverything) {
  const Scene scene = corner_with_board();
  std::vector<Motion> all;
  for (const char* shape : {"corner", "board", "lamp"}) all.push_back(translate(scene, shape, {0.3, 1, 0.5}));
  const TangentBasis basis = make_basis(scene, all);
  const GateSet gates(GateShape::steady(), {0.0});
  const EstimatorOptions options{.max_bounces = 1};  // D is x1
  const BoundaryGuide unguided({true, true, true, false, true});
  for (const double radius : {1e9, 0.0}) {
    const PreparedScene prepared(scene, &basis, {radius, 0});
    const BoundaryEdges edges(prepared);
    const GatePick pick(gates);
    VelocitySink sink;
    Worker worker(prepared, gates, options, pick, sink);
    SecondaryBoundary boundary(worker, edges, unguided, false);
    for (int i = 0; i < 2000; ++i) {
      Rng rng(Stream{9, 0, 0}, i, 0);
      boundary.sample_from_edge(0, 1, rng);
      boundary.sample_from_camera(i % 64, 1, rng);
    }
    EXPECT_GT(sink.segments, 100);
    if (radius > 0) {
      EXPECT_LT(sink.largest, 1e-9);
    } else {
      EXPECT_GT(sink.largest, 0.1) << "on its pixel ray x1 does not move along";
    }
  }
}

/// With x1 on its pixel ray the interior term's variance is infinite, and measured hundreds of times larger.
TEST(CameraFlow, CornersOfMovingObjectsAreQuiet) {
  const Scene scene = moving_corner();
  const TangentBasis basis = make_basis(scene, {translate(scene, "corner", {0.2, 1, 0.5})});
  const GateSet gates(GateShape::steady(), {0.0});
  double variance[2];
  for (const int follows : {0, 1}) {
    const Renderer renderer(scene, gates,
                            {.max_bounces = 3, .sampling = Sampling::standard, .follow_radius = 4.0 * follows}, &basis);
    const Estimate mean = term_means(renderer, Term::interior, 1, 1, 64, 32, {3, 0, 0})[0][0];
    variance[follows] = mean.standard_error * mean.standard_error;
  }
  EXPECT_GT(variance[0] / variance[1], 10);
  RecordProperty("ratio", std::to_string(variance[0] / variance[1]));
}

TEST(CameraFlow, IsLeftOutWhereNothingMovesCloseToAnything) {
  const auto possible = [](const std::function<void(Scene&)>& change) {
    Scene scene;
    scene.camera = {{0, 1, 6}, {0, 0, 0}, {0, 1, 0}, 40, 32, 32};
    add_shape(scene, "block", box({-0.5, -0.5, -0.5}, {0.5, 0.5, 0.5}), diffuse(Rgb(0.5)));
    add_shape(scene, "floor", quad({-3, -2, 3}, {3, -2, 3}, {3, -2, -3}, {-3, -2, -3}), diffuse(Rgb(0.5)));
    change(scene);
    const TangentBasis basis = make_basis(scene, {translate(scene, "block", {1, 0, 0})});
    return PreparedScene(scene, &basis, {4, 0}).flows.camera_possible();
  };
  EXPECT_FALSE(possible([](Scene&) {})) << "a convex block, far from all else";
  EXPECT_TRUE(possible([](Scene& s) {
    for (Vec3& p : s.positions)
      if (p.y == -2) p.y = -0.6;
  })) << "close to the floor";
  EXPECT_TRUE(possible([](Scene& s) { s.materials[0] = glass(0.3, 1.5); })) << "glass, from within";
  EXPECT_TRUE(possible([](Scene& s) { s.positions[7] = {0.1, 0.1, 0.1}; })) << "a dent";
}

}  // namespace
}  // namespace isochron::testing
