// Surfaces that pass through each other: the lines along which they do, and derivatives of what is seen there.
#include "core/geometry/mesh_intersections.h"

#include <gtest/gtest.h>

#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

double total_length(const Scene& scene) {
  const RayCaster caster(scene);
  double sum = 0;
  for (const MeshIntersection& p : find_mesh_intersections(scene, caster)) sum += length(p.end[1] - p.end[0]);
  return sum;
}

TEST(MeshIntersections, ABeamThroughACube) {
  Scene scene;
  add_shape(scene, "cube", box({-1, -1, -1}, {1, 1, 1}), diffuse(Rgb(0.5)));
  EXPECT_EQ(total_length(scene), 0);  // neighbours in a mesh do not pierce
  add_shape(scene, "beam", box({-0.3, -0.2, -3}, {0.4, 0.3, 3}), diffuse(Rgb(0.5)));
  EXPECT_NEAR(total_length(scene), 2 * 2 * (0.7 + 0.5), 1e-9);  // two rectangles
}

TEST(MeshIntersections, FollowTheSceneScale) {
  for (const double scale : {1e-3, 1.0, 1e3}) {
    Scene scene;
    add_shape(scene, "a", box(Vec3(-1, -1, -1) * scale, Vec3(1, 1, 1) * scale), diffuse(Rgb(0.5)));
    add_shape(scene, "b", box(Vec3(0.1, 0.2, 0.3) * scale, Vec3(2, 3, 4) * scale), diffuse(Rgb(0.5)));
    // On three faces of either cube, an L with arms to the first cube's edges.
    EXPECT_NEAR(total_length(scene) / scale, 2 * (0.9 + 0.8 + 0.7), 1e-9);
  }
}

TEST(MeshIntersections, AFoldedMeshPiercesItself) {
  // Two triangles with one vertex in common, the second of which goes through the first from there on.
  Scene scene;
  const Mesh mesh{{{0, 0, 0}, {2, -1, 0}, {2, 1, 0}, {1, 0, 1}, {1, 0, -1}}, {{0, 1, 2}, {0, 3, 4}}};
  add_shape(scene, "fold", mesh, diffuse(Rgb(0.5)));
  EXPECT_NEAR(total_length(scene), 1, 1e-9);
}

TEST(MeshIntersections, WhatTouchesDoesNotPierce) {
  Scene scene;
  add_shape(scene, "floor", quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), diffuse(Rgb(0.5)));
  add_shape(scene, "block", box({-0.5, 0, -0.5}, {0.5, 1, 0.5}), diffuse(Rgb(0.5)));
  EXPECT_EQ(total_length(scene), 0);
}

/// Two blocks through each other on a floor, all lit and seen from above.
Scene crossing_blocks() {
  Scene scene;
  scene.camera = {{0.7, 2.2, 2.6}, {0, 0.3, 0}, {0, 1, 0}, 40, 8, 8};
  add_shape(scene, "floor", quad({-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2}), diffuse(Rgb(0.5)));
  add_shape(scene, "a", box({-0.8, 0.05, -0.25}, {0.5, 0.4, 0.3}), diffuse(Rgb(0.9)));
  add_shape(scene, "b", box({-0.2, 0.1, -0.6}, {0.25, 0.7, 0.7}), diffuse(Rgb(0.2)));
  add_shape(scene, "lamp", quad({0.6, 2.5, 0.6}, {1.4, 2.5, 0.6}, {1.4, 2.5, 1.4}, {0.6, 2.5, 1.4}), diffuse(Rgb(0.0)),
            Rgb(20.0));
  return scene;
}

// The image's mean against finite differences with common random numbers: z-tests at 4 standard errors (false alarm 6e-5
// each, 8 of them). Without the intersections the clearest of each pair fails by 10 to 60.
TEST(MeshIntersections, DerivativesAgreeWithFiniteDifferences) {
  const Scene scene = crossing_blocks();
  const GateSet gates(GateShape::gaussian(0.4), {5.0, 5.6});
  const Motion a = translate(scene, "a", {1, 0.2, 0.3}), b = translate(scene, "b", {1, 0.2, 0.3});
  const Motion together{[=](Scene& target, double t) { a.apply(target, t), b.apply(target, t); },
                        [=](const Scene& source, std::vector<std::pair<int, double>>& out) {
                          a.velocity(source, out);
                          b.velocity(source, out);
                        }};
  struct Case {
    const char* name;
    Motion motion;
    int max_bounces;
  };
  // Where the two move apart, light that is reflected twice also needs what one of them covers of the other: not modelled.
  for (const Case& c :
       {Case{"together", together, 3}, Case{"sideways", translate(scene, "b", {1, 0, 0}), 1},
        Case{"up", translate(scene, "a", {0, 1, 0}), 1}, Case{"turn", rotate_y(scene, "b", {0, 0, 0}), 1}}) {
    const TangentBasis basis = make_basis(scene, {c.motion});
    const EstimatorOptions options{.max_bounces = c.max_bounces, .sampling = Sampling::standard, .guiding_samples = 32};
    const Renderer renderer(scene, gates, options, &basis);
    constexpr int kBatches = 32;
    const auto interior = term_means(renderer, Term::interior, 1, 2, 128, kBatches, {1, 0, 0});
    const auto visibility =
        term_means(renderer, Term::visibility, 1, 2, samples_of(Term::visibility, 128), kBatches, {2, 0, 0});
    const auto difference = finite_difference(scene, c.motion, 0.01, gates, options, 512, kBatches, {3, 0, 0});
    for (int g = 0; g < 2; ++g) {
      const Estimate total{interior[0][g].mean + visibility[0][g].mean,
                           std::hypot(interior[0][g].standard_error, visibility[0][g].standard_error)};
      EXPECT_LT(std::abs(z_score(total, difference[g])), 4)
          << c.name << ", gate " << g << ": " << total.mean << " +- " << total.standard_error << ", finite difference "
          << difference[g].mean << " +- " << difference[g].standard_error;
    }
  }
}

}  // namespace
}  // namespace isochron::testing
