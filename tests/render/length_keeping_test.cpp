// Paths that keep their lengths (theory section 7): the same derivatives as by coupled pairs, and under Dirac gates as finite
// differences of images.
//
// Statistics: z-tests at 4.5 standard errors (false alarms: 7e-6 each, 5e-4 for the file). Half of a case's derivatives must be known
// to 5 % of its largest term. Not all: ends of circles have a tail of index 2, and a rare sample makes one error several times as large.
#include <gtest/gtest.h>

#include <algorithm>

#include "core/base/error.h"
#include "support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// A tilted floor and a lamp above it, shifted sideways.
Scene floor_under_lamp(double half_width, double shift, Material floor = diffuse(Rgb(0.7))) {
  Scene scene;
  scene.camera.position = {0, 1.5, 3};
  scene.camera.look_at = {0.1, 0, -0.1};
  scene.camera.fov = 30;
  scene.camera.width = scene.camera.height = 8;
  const double w = half_width;
  add_shape(scene, "floor", quad({-2, 0.1, 2}, {2, 0.1, 2}, {2, 0, -2}, {-2, 0, -2}), std::move(floor));
  add_shape(scene, "lamp", quad({shift - w, 2, -w}, {shift + w, 2, -w}, {shift + w, 2, w}, {shift - w, 2, w}),
            diffuse(Rgb(0.0)), Rgb(10));
  return scene;
}

/// The same with a screen between them.
Scene floor_in_shadow(Material floor = diffuse(Rgb(0.7))) {
  Scene scene = floor_under_lamp(0.5, 1.5, std::move(floor));
  add_shape(scene, "screen", quad({0.4, 1, 0.2}, {0.9, 1, 0.2}, {0.9, 1.1, -0.2}, {0.4, 1.1, -0.2}),
            diffuse(Rgb(0.5), true));
  return scene;
}

std::vector<Motion> motions_of_floor_lamp_and_screen(const Scene& scene) {
  return {translate(scene, "floor", {0, 1, 0}),
          translate(scene, "lamp", {0.3, 1, 0.2}),
          translate(scene, "screen", {1, 0.5, 0}),
          // stretches the lamp in its plane and bends its triangles
          translate(scene, "lamp", {0.4, 0, 0.3}, [](const Vec3& p) { return p.z > 0 && p.x > 0.6; }),
          // all paths are longer
          {[](Scene& target, double t) { target.detector.time_offset[0] += t; },
           [](const Scene& source, std::vector<std::pair<int, double>>& out) {
             out.emplace_back(DofLayout(source).time_offset(0), 1.0);
           }}};
}

struct Totals {
  std::vector<std::vector<Estimate>> sum;  ///< [column][gate], of all terms
  double largest_term = 0;
};

Totals totals(const Scene& scene, const TangentBasis& basis, const GateSet& gates, EstimatorOptions options, bool keep,
              int samples, int batches, std::uint32_t seed) {
  options.keep_length = keep;
  const Renderer renderer(scene, gates, options, &basis);
  Totals totals{std::vector(basis.columns, std::vector<Estimate>(gates.size()))};
  for (const Term term : kTerms) {
    const auto means = term_means(renderer, term, basis.columns, gates.size(), samples_of(term, samples), batches,
                                  {test_seed(seed), 0, 0});
    for (int c = 0; c < basis.columns; ++c)
      for (int g = 0; g < gates.size(); ++g) {
        Estimate& sum = totals.sum[c][g];
        sum.mean += means[c][g].mean;
        sum.standard_error = std::hypot(sum.standard_error, means[c][g].standard_error);
        totals.largest_term = std::max(totals.largest_term, std::abs(means[c][g].mean));
      }
  }
  return totals;
}

void expect_equal(const Totals& ours, const std::vector<std::vector<Estimate>>& expected) {
  std::vector<double> errors;
  for (std::size_t c = 0; c < expected.size(); ++c)
    for (std::size_t g = 0; g < expected[c].size(); ++g) {
      const Estimate &a = ours.sum[c][g], &b = expected[c][g];
      errors.push_back(std::hypot(a.standard_error, b.standard_error));
      EXPECT_LT(std::abs(z_score(a, b)), 4.5) << "column " << c << ", gate " << g << ": " << a.mean << " +- "
                                              << a.standard_error << ", not " << b.mean << " +- " << b.standard_error;
    }
  const auto middle = errors.begin() + static_cast<std::ptrdiff_t>((errors.size() - 1) / 2);
  std::nth_element(errors.begin(), middle, errors.end());
  EXPECT_LT(*middle, 0.05 * ours.largest_term);
}

void compare_with_pairs(const Scene& scene, const std::vector<Motion>& motions, const GateSet& gates,
                        const EstimatorOptions& options, int samples, int batches) {
  const TangentBasis basis = make_basis(scene, motions);
  expect_equal(totals(scene, basis, gates, options, true, samples, batches, 1),
               totals(scene, basis, gates, options, false, samples, batches, 2).sum);
}

constexpr EstimatorOptions kDirect{.max_bounces = 1, .sampling = Sampling::ellipsoidal, .guiding_samples = 64};

TEST(LengthKeeping, DirectLightWithShadowsAndBorders) {
  const Scene scene = floor_in_shadow();
  compare_with_pairs(scene, motions_of_floor_lamp_and_screen(scene),
                     GateSet(GateShape::gaussian(0.05), {5.4, 5.7, 6.0}), kDirect, 64, 64);
}

TEST(LengthKeeping, GlossyInColourUnderGatesThatJump) {
  const Scene scene = floor_in_shadow(conductor(Rgb(0.9, 0.6, 0.3), 0.4));
  compare_with_pairs(scene, motions_of_floor_lamp_and_screen(scene), GateSet(GateShape::boxcar(0.2), {5.4, 5.7, 6.0}),
                     kDirect, 128, 64);
}

/// The nearest point of the lamp is the foot of the floor's: circles begin there.
TEST(LengthKeeping, WhereLightFromAWideLampComesFirst) {
  const Scene scene = floor_under_lamp(3, 0);
  compare_with_pairs(scene, {translate(scene, "floor", {0, 1, 0}), translate(scene, "lamp", {0.3, 1, 0.2})},
                     GateSet(GateShape::gaussian(0.05), {5.1, 5.3, 5.5}), kDirect, 128, 64);
}

/// A shelf that passes through the floor: of two surfaces in line with the lamp and the screen's edges one hides the other.
Scene floor_and_shelf_in_shadow() {
  Scene scene = floor_in_shadow();
  add_shape(scene, "shelf", quad({-1.5, 0.4, 1}, {1.2, 0.4, 1}, {1.2, -0.1, -0.8}, {-1.5, -0.1, -0.8}),
            diffuse(Rgb(0.6), true));
  return scene;
}

/// Segments at lengths drawn from the gates against those that chance brings there.
class ShadowEdges : public ::testing::TestWithParam<bool> {};

TEST_P(ShadowEdges, AtLengths) {
  const Scene scene = GetParam() ? floor_and_shelf_in_shadow() : floor_in_shadow();
  const TangentBasis basis = make_basis(scene, {translate(scene, "screen", {1, 0.5, 0})});
  const GateSet gates(GateShape::gaussian(0.02), {5.4, 5.7, 6.0});
  EstimatorOptions random = kDirect;
  random.boundary.at_length = false;
  expect_equal(totals(scene, basis, gates, kDirect, true, 128, 64, 1),
               totals(scene, basis, gates, random, true, 128, 64, 2).sum);
}

INSTANTIATE_TEST_SUITE_P(Floor, ShadowEdges, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "and_shelf" : "alone"; });

Scene box_with_panel() {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 8;
  return scene;
}

TEST(LengthKeeping, ThreeBounces) {
  const Scene scene = box_with_panel();
  compare_with_pairs(scene, {translate(scene, "light", {0.4, 0.5, 0.3}), translate(scene, "panel", {0.3, 0.2, 0.1})},
                     GateSet(GateShape::gaussian(0.1), {5.0, 5.5, 6.0}),
                     {.max_bounces = 3, .sampling = Sampling::ellipsoidal, .guiding_samples = 64}, 32, 64);
}

void compare_dirac(const Scene& scene, const std::vector<Motion>& motions, const std::vector<double>& lengths,
                   const EstimatorOptions& options, double step, int samples, int batches) {
  const GateSet gates(GateShape::dirac(), lengths);
  std::vector<std::vector<Estimate>> expected;
  for (const Motion& motion : motions)
    expected.push_back(finite_difference(scene, motion, step, gates, options, samples, batches, {test_seed(3), 0, 0}));
  expect_equal(totals(scene, make_basis(scene, motions), gates, options, true, samples, batches, 1), expected);
}

TEST(LengthKeeping, DiracGatesOfDirectLight) {
  const Scene scene = floor_in_shadow();
  compare_dirac(scene, motions_of_floor_lamp_and_screen(scene), {5.4, 5.7, 6.0}, kDirect, 0.01, 128, 64);
}

TEST(LengthKeeping, DiracGatesWhereLightComesFirst) {
  const Scene scene = floor_under_lamp(3, 0);
  compare_dirac(scene, {translate(scene, "floor", {0, 1, 0}), translate(scene, "lamp", {0.3, 1, 0.2})}, {5.1, 5.3, 5.5},
                kDirect, 0.01, 256, 64);
}

TEST(LengthKeeping, DiracGatesOfThreeBounces) {
  const Scene scene = box_with_panel();
  compare_dirac(scene, {translate(scene, "light", {0.4, 0.5, 0.3}), translate(scene, "panel", {0.3, 0.2, 0.1})},
                {5.0, 5.5, 6.0}, {.max_bounces = 3, .sampling = Sampling::ellipsoidal, .guiding_samples = 64}, 0.01, 32,
                64);
}

/// Gradients of a loss whose pixels and gates count unevenly: how often lengths are drawn for one then enters all weights.
TEST(LengthKeeping, GradientsUnderUnevenAdjoints) {
  const Scene scene = floor_in_shadow();
  const TangentBasis basis = make_basis(scene, {translate(scene, "lamp", {0.3, 1, 0.2})});
  const GateSet gates(GateShape::gaussian(0.03), {5.4, 5.7, 6.0});
  GatedImage adjoint(8, 8, 3, 1);
  for (int pixel = 0; pixel < adjoint.pixels(); ++pixel)
    for (int g = 0; g < 3; ++g) adjoint.at(pixel, g) = pixel % 3 == g ? 0 : (1.0 + pixel % 8) * std::pow(5.0, -g);
  const auto gradient = [&](bool keep) {
    EstimatorOptions options = kDirect;
    options.keep_length = keep;
    const Renderer renderer(scene, gates, options, &basis);
    Batches batches;
    for (int b = 0; b < 64; ++b) {
      std::vector<double> dofs(DofLayout(scene).size(), 0.0);
      for (const Term term : kTerms)
        renderer.add_gradient(term, adjoint,
                              {test_seed(4), static_cast<std::uint32_t>(b), static_cast<std::uint32_t>(term)},
                              {0, samples_of(term, 512)}, dofs);
      batches.add(basis.transpose_apply(dofs)[0]);
    }
    return batches.estimate();
  };
  const Estimate kept = gradient(true), pairs = gradient(false);
  EXPECT_LT(std::abs(z_score(kept, pairs)), 4.5)
      << kept.mean << " +- " << kept.standard_error << ", by pairs " << pairs.mean << " +- " << pairs.standard_error;
  EXPECT_LT(std::hypot(kept.standard_error, pairs.standard_error), 0.1 * std::abs(pairs.mean));
}

TEST(LengthKeeping, DiracGatesSayWhatTheyCannot) {
  Scene scene = floor_under_lamp(0.5, 1.5);
  const TangentBasis basis = make_basis(scene, {translate(scene, "lamp", {0, 1, 0})});
  const GateSet gates(GateShape::dirac(), {5.4});
  EXPECT_THROW(Renderer(scene, gates, {.sampling = Sampling::standard}), InputError);
  EXPECT_NO_THROW(Renderer(scene, gates, {}, &basis));
  EXPECT_THROW(Renderer(scene, gates, {.keep_length = false}, &basis), InputError);
  EXPECT_THROW(Renderer(scene, gates, {.sampling = Sampling::standard, .keep_length = true}, &basis), InputError);
  // A lamp in the image, at distances of 4.5 and more.
  add_shape(scene, "seen", quad({-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}), diffuse(Rgb(0.0)), Rgb(10));
  EXPECT_THROW(Renderer(scene, GateSet(GateShape::dirac(), {4.2}), {}, &basis), InputError);
  EXPECT_NO_THROW(Renderer(scene, GateSet(GateShape::dirac(), {7.5}), {}, &basis));
}

}  // namespace
}  // namespace isochron::testing
