// Objects in contact: a cube that stands on the floor (coplanar faces, edges that lie in another surface) and
// a lamp whose border lies in a wall.
//
// Statistics: z-tests at 4.5 standard errors with fixed seeds (false alarms: 7e-6 each, 10 of them), whose errors must be
// below 3 % of what is compared: 0.8 to 2 % were measured. The smallest term that is not zero makes 12 %.
//
// Light between two surfaces that touch is for contact_test.cpp; a black cube has none, but everything else about standing
// on a floor.
#include <gtest/gtest.h>

#include "core/base/constants.h"
#include "tests/render/scene_building.h"
#include "tests/render/support.h"

namespace isochron::testing {
namespace {

/// A cube of side 0.6 on the floor of an open corner: floor, back wall and left wall, a lamp above.
Scene standing_cube(double albedo) {
  Scene scene;
  scene.camera.position = {0.9, 1.1, 2.6};
  scene.camera.look_at = {-0.1, 0.25, 0};
  scene.camera.fov = 45;
  scene.camera.width = scene.camera.height = 16;
  add_shape(scene, "floor", quad({-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1}), diffuse(Rgb(0.7)));
  add_shape(scene, "back", quad({-1, 0, -1}, {1, 0, -1}, {1, 1.5, -1}, {-1, 1.5, -1}), diffuse(Rgb(0.7)));
  add_shape(scene, "left", quad({-1, 0, 1}, {-1, 0, -1}, {-1, 1.5, -1}, {-1, 1.5, 1}), diffuse(Rgb(0.7)));
  add_shape(scene, "cube", box({-0.35, 0, -0.35}, {0.25, 0.6, 0.25}), diffuse(Rgb(albedo)));
  add_shape(scene, "lamp", quad({0.3, 1.8, 0.2}, {0.9, 1.8, 0.2}, {0.9, 1.8, 0.8}, {0.3, 1.8, 0.8}), diffuse(Rgb(0.0)),
            Rgb(10.0));
  return scene;
}

struct StandingCase {
  const char* name;
  GateShape shape;
  double center;
  Sampling sampling;
  double albedo;  ///< of the cube
  int max_bounces;
  int samples;
};
void PrintTo(const StandingCase& c, std::ostream* out) {
  *out << c.name;
}

class StandingCube : public ::testing::TestWithParam<StandingCase> {};

TEST_P(StandingCube, SidewaysDerivativeIsThatOfFiniteDifferences) {
  const StandingCase& c = GetParam();
  const Scene scene = standing_cube(c.albedo);
  const std::vector<Motion> motions = {translate(scene, "cube", {1, 0, 0}), translate(scene, "cube", {0, 0, 1})};
  const TangentBasis basis = make_basis(scene, motions);
  const GateSet gates(c.shape, {c.center});
  EstimatorOptions options{.max_bounces = c.max_bounces, .sampling = c.sampling};
  const Renderer renderer(scene, gates, options, &basis);
  std::vector<std::vector<Estimate>> terms[3];
  for (int t = 0; t < 3; ++t)
    terms[t] = term_means(renderer, kTerms[t], 2, 1, samples_of(kTerms[t], c.samples), 32, {41, 0, 0});
  options.sampling = Sampling::standard;
  for (int m = 0; m < 2; ++m) {
    const Estimate difference = finite_difference(scene, motions[m], 0.03, gates, options, 120, 32, {42, 0, 0})[0];
    Estimate total;
    double scale = 0;
    for (const auto& term : terms) {
      total.mean += term[m][0].mean;
      total.standard_error = std::hypot(total.standard_error, term[m][0].standard_error);
      scale = std::hypot(scale, term[m][0].mean);
    }
    const double error = std::hypot(total.standard_error, difference.standard_error);
    EXPECT_LT(error, 0.03 * scale);
    EXPECT_LT(std::abs(z_score(total, difference)), 4.5)
        << "motion " << m << ": " << total.mean << " +- " << total.standard_error << ", finite difference "
        << difference.mean << " +- " << difference.standard_error;
  }
}

INSTANTIATE_TEST_SUITE_P(
    Gates, StandingCube,
    ::testing::Values(
        StandingCase{"direct_gaussian_standard", GateShape::gaussian(0.4), 5.0, Sampling::standard, 0.7, 1, 40},
        StandingCase{"direct_boxcar_ellipsoidal", GateShape::boxcar(1.2), 5.0, Sampling::ellipsoidal, 0.7, 1, 24},
        StandingCase{"black_steady", GateShape::steady(), 0, Sampling::standard, 0, 2, 40},
        StandingCase{"black_boxcar_ellipsoidal", GateShape::boxcar(1.2), 5.0, Sampling::ellipsoidal, 0, 2, 24}),
    [](const auto& test) { return test.param.name; });

/// Irradiance at p with normal n from a polygon of unit radiance, all of it above p's horizon (Lambert's
/// formula).
double irradiance(const Vec3& p, const Vec3& n, const std::vector<Vec3>& polygon) {
  double sum = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3 a = normalize(polygon[i] - p), b = normalize(polygon[(i + 1) % polygon.size()] - p);
    const Vec3 normal = cross(a, b);
    sum += std::atan2(length(normal), dot(a, b)) * dot(n, normal) / length(normal);
  }
  return 0.5 * std::abs(sum);
}

TEST(LampOnWall, ImageIsThatOfQuadrature) {
  // The image's upper border is where the lamp meets the wall, seen from below the lamp's plane.
  const Vec3 lamp[4] = {{0, 1, -0.5}, {0.5, 1, -0.5}, {0.5, 1, 0.5}, {0, 1, 0.5}};
  Scene scene;
  scene.camera.position = {1.5, 0.8, 0};
  scene.camera.look_at = {0, 0.8, 0};
  scene.camera.fov = 2 * std::atan(0.2 / 1.5) * 180 / kPi;
  scene.camera.width = scene.camera.height = 8;
  add_shape(scene, "wall", quad({0, -1, -2}, {0, 2, -2}, {0, 2, 2}, {0, -1, 2}), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad(lamp[0], lamp[1], lamp[2], lamp[3]), diffuse(Rgb(0.0)), Rgb(7.0));
  const TangentBasis basis =
      make_basis(scene, {translate(scene, "lamp", {0, 1, 0}), translate(scene, "wall", {1, 0, 0})});

  double exact = 0;
  constexpr int kSteps = 300;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const Vec3 p{0, 0.6 + 0.4 * (i + 0.5) / kSteps, -0.2 + 0.4 * (j + 0.5) / kSteps};
      exact += 7 * 0.6 / kPi * irradiance(p, {1, 0, 0}, {lamp[0], lamp[1], lamp[2], lamp[3]}) / (kSteps * kSteps);
    }
  // A gate that is constant over all lengths of direct light, 1.5 to 2.8.
  const double width = 1.6;
  for (const Sampling sampling : {Sampling::standard, Sampling::ellipsoidal}) {
    const GateSet gates(GateShape::boxcar(width), {2.1});
    const Renderer renderer(scene, gates, {.max_bounces = 1, .sampling = sampling}, &basis);
    const Estimate image = image_means(renderer, 1, 100, 32, {43, 0, 0})[0];
    EXPECT_LT(image.standard_error, 0.02 * exact / width);
    EXPECT_LT(std::abs(image.mean - exact / width), 4.5 * image.standard_error)
        << image.mean << " +- " << image.standard_error << ", exact " << exact / width;
    for (const Term term : kTerms)
      for (const GatedImage& d : renderer.derive(term, {43, 0, 1}, {0, 200}))
        for (const double x : d.data) EXPECT_TRUE(std::isfinite(x));
  }
}

}  // namespace
}  // namespace isochron::testing
