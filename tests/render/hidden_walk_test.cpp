// Hidden geometry sampling in walks: images and derivatives have the means that BSDF sampling alone gives. Against quadrature:
// capture_test.cpp.
//
// Statistics: z-tests at 4.5 standard errors of the difference (false alarms: 7e-6 each), fixed seeds. Both standard errors must
// be below 3 % of the derivative's scale, so that a density that lacks a term or a factor fails.
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
      EXPECT_LT(a.standard_error, scatter_of_errors(kBatches) * 0.03 * scale) << "motion " << m << " gate " << g;
      EXPECT_LT(b.standard_error, scatter_of_errors(kBatches) * 0.03 * scale) << "motion " << m << " gate " << g;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Gates, HiddenWalk, ::testing::Values(GateShape::gaussian(0.3), GateShape::boxcar(0.8)));

/// A board in a room before the wall of a capture: the board is seen from the wall and by way of the room.
Scene board_in_room() {
  Scene scene;
  scene.capture.emplace();
  scene.capture->columns = scene.camera.width = 2;
  scene.capture->rows = scene.camera.height = 1;
  scene.capture->sensor = {{{-0.3, 0.1, 0}, {0, 0, 1}}, {{0.2, -0.2, 0}, {0, 0, 1}}};
  scene.camera.look_at = {0, 0, 1};
  add_shape(scene, "board", quad({-0.2, -0.2, 0.5}, {-0.2, 0.2, 0.5}, {0.2, 0.2, 0.5}, {0.2, -0.2, 0.5}),
            diffuse(Rgb(0.7), true));
  Mesh room = box({-0.8, -0.8, -0.1}, {0.8, 0.8, 1}, true);
  add_shape(scene, "room", room, diffuse(Rgb(0.7)));
  return scene;
}

// Named shapes alone, or in a capture without names all of them; by area: the density is one over it.
TEST(HiddenGeometry, IsWhatIsNamed) {
  for (const bool named : {true, false}) {
    Scene scene = board_in_room();
    const int board = scene.find_shape("board");
    scene.shapes[board].hidden = named;
    const PreparedScene prepared(scene, nullptr);
    EXPECT_NEAR(1 / prepared.hidden.pdf(), named ? 0.16 : 0.16 + 2 * 1.6 * 1.6 + 4 * 1.6 * 1.1, 1e-12);
    constexpr int kDraws = 1000;
    int on_board = 0;
    for (int i = 0; i < kDraws; ++i)
      on_board += prepared.shape_index(prepared.sample_hidden((i + 0.5) / kDraws, 0.5).triangle) == board;
    EXPECT_NEAR(on_board, kDraws * 0.16 * prepared.hidden.pdf(), 2);
  }
}

/// Three bounces, with and without unknowns that every path changes: then the last step may have to lead to the board.
TEST(HiddenGeometry, LeavesCapturesUnbiased) {
  Scene scene = board_in_room();
  const GateSet gates(GateShape::gaussian(0.15), {1.1, 1.6});
  const Motion gain{{}, [](const Scene& source, auto& out) { out.emplace_back(DofLayout(source).gain(), 1.0); }};
  const Motion towards = translate(scene, "board", {0.2, 0, -1});
  constexpr int kBatches = 32, kSamples = 8192;
  for (const bool named : {true, false})
    for (const bool every_path : {true, false}) {
      scene.shapes[0].hidden = named;
      const TangentBasis basis = make_basis(scene, every_path ? std::vector{towards, gain} : std::vector{towards});
      EstimatorOptions options{.max_bounces = 3};
      const Renderer ours(scene, gates, options, &basis);
      options.hidden = 0;
      const Renderer plain(scene, gates, options, &basis);
      const auto found = term_means(ours, Term::interior, basis.columns, 2, kSamples, kBatches, {74, 0, 0}),
                 expected = term_means(plain, Term::interior, basis.columns, 2, kSamples, kBatches, {75, 0, 0});
      const auto image = image_means(ours, 2, kSamples, kBatches, {76, 0, 0}),
                 expected_image = image_means(plain, 2, kSamples, kBatches, {77, 0, 0});
      const auto compare = [&](const Estimate& a, const Estimate& b, const std::string& what) {
        EXPECT_LT(std::abs(z_score(a, b)), 4.5)
            << what << (named ? ", board named" : "") << ": " << a.mean << " +- " << a.standard_error << ", without "
            << b.mean << " +- " << b.standard_error;
        EXPECT_LT(std::hypot(a.standard_error, b.standard_error), scatter_of_errors(kBatches) * 0.03 * std::abs(b.mean))
            << what;
      };
      for (int g = 0; g < 2; ++g) {
        compare(image[g], expected_image[g], "image");
        for (int column = 0; column < basis.columns; ++column)
          compare(found[column][g], expected[column][g], column ? "gain" : "motion");
      }
    }
}

/// Where no shape is named, a board alone is found by area, evenly: with evenly spread numbers far better than by the wall's
/// reflection. A room is found both ways, half of the samples each. The second moment of the balance heuristic is at most
/// twice that of either way; of independent samples by reflection it is 1.1 times the variance here, so that the deviation
/// grows by sqrt(2 * 1.1 - 0.1) = 1.45 at most. Deviations of 256 batches are known to some 5 %.
TEST(HiddenGeometry, IsAboutAsGoodAsTheBetterWayWithoutNames) {
  Scene board = board_in_room();
  board.shapes.pop_back();
  board.triangles.resize(2);
  board.positions.resize(4);
  std::erase_if(board.edges, [](const Edge& e) { return e.vertex[0] >= 4; });
  const Scene room = board_in_room();
  const GateSet gates(GateShape::gaussian(0.15), {1.1, 1.6});
  const auto deviation = [&](const Scene& scene, Numbers numbers, std::optional<double> share) {
    EstimatorOptions options{.max_bounces = 1, .hidden = share};
    options.numbers = numbers;
    return image_means(Renderer(scene, gates, options), 2, 256, 256, {78, 0, 0})[0].standard_error;
  };
  // Measured with five seeds: 0.016 to 0.021.
  EXPECT_LT(deviation(board, Numbers::low_discrepancy, {}), 0.05 * deviation(board, Numbers::low_discrepancy, 0.0));
  const double both = deviation(room, Numbers::independent, {});
  EXPECT_LT(both, 1.8 * deviation(room, Numbers::independent, 0.0));     // 1.45 and five standard errors of a ratio
  EXPECT_LT(both, 0.75 * deviation(room, Numbers::independent, 0.999));  // measured: 0.32 to 0.55
}

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
