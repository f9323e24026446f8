// Rough glass in whole images: the white furnace, the optical length of a slab, and agreement of the two samplings.
#include <gtest/gtest.h>

#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

constexpr int kGlassBatches = 32;

/// A block of glass with no two faces parallel, so that it traps no light, in a room whose black walls emit 1.
Scene glass_furnace(double ior) {
  Scene scene;
  add_shape(scene, "walls", box({-2, -2, -2}, {2, 2, 2}, true), diffuse(Rgb(0)), Rgb(1.0));
  Mesh mesh = box({-0.5, -0.4, -0.5}, {0.5, 0.4, 0.5});
  for (Vec3& p : mesh.positions) {
    const Vec3 q = p;
    p.x += 0.15 * q.y - 0.2 * q.y * q.z;
    p.y += 0.3 * q.x * q.z;
  }
  add_shape(scene, "glass", mesh, glass(0.02, ior));
  return scene;
}

// Radiance is 1 everywhere outside, whatever is refracted on the way, and the squared index inside. What single
// scattering loses is at most 2 % at this roughness, and paths of over 60 bounces carry less than 1 %. z < 5.
TEST(Glass, WhiteFurnace) {
  for (const double ior : {1.5, 0.7})
    for (const bool inside : {false, true}) {
      Scene scene = glass_furnace(ior);
      scene.camera = {inside ? Vec3{0.05, 0, 0.1} : Vec3{0.3, 0.5, 1.6}, {0, 0, 0}, {0, 1, 0}, 40, 8, 8};
      const GateSet steady(GateShape::steady(), {0});
      const Renderer renderer(scene, steady, {.max_bounces = 60});
      const Estimate e = image_means(renderer, 1, 16, kGlassBatches, {61, 0, 0})[0];
      const double expected = inside ? ior * ior : 1;
      EXPECT_LT(e.mean, expected + 5 * e.standard_error) << ior << (inside ? " inside" : "");
      EXPECT_GT(e.mean, 0.98 * expected - 5 * e.standard_error) << ior << (inside ? " inside" : "");
      EXPECT_LT(e.standard_error, scatter_of_errors(kGlassBatches) * 0.02 * expected);
    }
}

// A lamp behind a slab, seen head-on: Fresnel lets (4 n / (n + 1)^2)^2 of its radiance through, later by (n - 1) times
// the thickness. The roughness of 0.002 lengthens a path by less than 1e-4.
TEST(Glass, SlabDelaysLight) {
  for (const double ior : {1.5, 1.2, 0.8}) {
    const double thickness = 0.7, distance = 3, expected = distance + (ior - 1) * thickness;
    Scene scene;
    scene.camera = {{0, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0.2, 2, 2};
    add_shape(scene, "lamp", quad({-1, -1, distance}, {-1, 1, distance}, {1, 1, distance}, {1, -1, distance}),
              diffuse(Rgb(0)), Rgb(1.0));
    add_shape(scene, "slab", box({-1, -1, 1}, {1, 1, 1 + thickness}), glass(0.002, ior));
    std::vector<double> centers;
    constexpr double kWidth = 0.002;
    for (int g = -20; g <= 20; ++g) centers.push_back(expected + (g + 0.25) * kWidth);
    const GateSet gates(GateShape::boxcar(kWidth), centers);
    const Renderer renderer(scene, gates, {.max_bounces = 2, .sampling = Sampling::standard});
    const GatedImage image = renderer.render({62, 0, 0}, {0, 4000});
    double sum = 0, moment = 0;
    for (int g = 0; g < gates.size(); ++g) {
      sum += image.mean(g) * kWidth;
      moment += image.mean(g) * kWidth * centers[g];
    }
    EXPECT_NEAR(moment / sum, expected, kWidth) << ior;
    const double passes = 4 * ior / ((ior + 1) * (ior + 1));
    EXPECT_NEAR(sum, passes * passes, 5 * std::sqrt(passes * (1 - passes) / 16000) + 2e-3) << ior;
  }
}

// Paths through the glass block of the validation scene, by two samplings that share nothing but the scene. 3 gates at
// 4.5 standard errors.
TEST(Glass, StandardAgreesWithEllipsoidal) {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  Material& block = scene.materials[scene.find_material("block")];
  const std::string name = block.name;
  block = glass(0.3, 1.5);
  block.name = name;
  const GateSet gates(GateShape::gaussian(0.25), {4.6, 5.3, 6.0});
  std::vector<Estimate> results[2];
  for (const bool ellipsoidal : {false, true}) {
    const Sampling sampling = ellipsoidal ? Sampling::ellipsoidal : Sampling::standard;
    const Renderer renderer(scene, gates, {.max_bounces = 4, .sampling = sampling});
    results[ellipsoidal] = image_means(renderer, 3, ellipsoidal ? 80 : 60, kGlassBatches, {63, ellipsoidal, 0});
  }
  for (int g = 0; g < 3; ++g) {
    const Estimate &a = results[0][g], &b = results[1][g];
    EXPECT_LT(std::abs(z_score(a, b)), 4.5)
        << g << ": " << a.mean << " +- " << a.standard_error << ", " << b.mean << " +- " << b.standard_error;
    EXPECT_LT(std::hypot(a.standard_error, b.standard_error), scatter_of_errors(kGlassBatches) * 0.03 * a.mean);
  }
}

}  // namespace
}  // namespace isochron::testing
