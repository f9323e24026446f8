// Total derivative = finite differences, for everything that can move, in a diffuse and a glossy scene and
// ones with retroreflectors and glass, under every kind of gate and both samplings. The finite differences render the moved scenes
// with common random numbers.
//
// Statistics: 2 gates x 7 to 9 parameters per case, each a z-test at 4.6 standard errors of the difference, which 32 replicates
// exceed as rarely as normal numbers exceed 4 (false alarms: 18 x 6e-5 = 0.1 % per case), fixed seeds. The standard error of the
// difference must be below 5 % of the derivative's scale (15 % in the glossy ones, 50 % with glass and twice that for motions of
// the glass): the terms' root mean square over gates and over all motions, which have comparable speeds; over
// gates for a material's parameter. The steps are small enough that their bias, of second order, stays below
// that. The glass's roughness and, under ellipsoidal sampling, its ior change these images little, and so does the roughness of a
// retroreflector: limits on their errors are wider, about 1.4 to 2 times what was seen, so that z-tests of them catch gross errors alone
// but more noise than that shows. Of the roughness most is the finite differences'; our own error has a limit of its own.
// ISOCHRON_TEST_SAMPLES=16 in the environment takes 16 times the samples, for errors four times smaller.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/render/support.h"

namespace isochron::testing {
namespace {

enum class Look { diffuse, glossy, retroreflecting, plastic, glass };

struct DifferenceCase {
  const char* name;
  Look look;
  GateShape shape;
  Sampling sampling;
  int samples, reference_samples;  ///< per batch
};
void PrintTo(const DifferenceCase& c, std::ostream* out) {
  *out << c.name;
}

/// With a response that comes late and has a tail.
const GateShape kBin = GateShape::bin(0.5, {-0.3, 0, 1.2}, {0, 1, 0});

class FiniteDifference : public ::testing::TestWithParam<DifferenceCase> {};

TEST_P(FiniteDifference, TotalDerivative) {
  const DifferenceCase& c = GetParam();
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  if (c.look == Look::glass) replace_material(scene, "block", glass(0.3, 1.5));
  if (c.look == Look::glossy) {
    replace_material(scene, "block", conductor(Rgb(0.9), 0.5));
    replace_material(scene, "panel", conductor(Rgb(0.9), 0.5, true));
  }
  if (c.look == Look::retroreflecting) {
    replace_material(scene, "block", retroreflector(Rgb(0.3), Rgb(0.6), 0.5));
    replace_material(scene, "panel", retroreflector(Rgb(0.2), Rgb(0.7), 0.5, true));
  }
  if (c.look == Look::plastic) {
    replace_material(scene, "block", plastic(Rgb(0.5), 0.5, 2.0));
    replace_material(scene, "panel", plastic(Rgb(0.6), 0.5, 2.0, true));
  }
  const Vec3 corner = scene.positions[scene.shapes[scene.find_shape("block")].first_vertex + 2];
  const Vec3 middle = scene.positions[scene.shapes[scene.find_shape("panel")].first_vertex + 4];
  const auto at = [](const Vec3& place) { return [=](const Vec3& p) { return p == place; }; };
  struct Parameter {
    const char* name;
    Motion motion;
    double step;
    bool geometry = true;
    double slack = 1;             ///< of the limit to the standard error
    double own_slack = INFINITY;  ///< of the same to our own part of it, where that has a limit
  };
  const bool glass = c.look == Look::glass;
  std::vector<Parameter> parameters = {
      {"moving object", translate(scene, "block", {0.3, 1, 0.2}), 0.01, true, glass ? 2.0 : 1.0},
      {"moving light", translate(scene, "light", {0.4, 0, 0.3}), 0.01},
      {"moving receiver", translate(scene, "panel", {-1, 0.2, 0.1}), 0.01},
      {"rotation", rotate_y(scene, "block", {-0.9, -0.4, -0.6}), 0.02, true, glass ? 2.0 : 1.0},
      {"vertex of a silhouette", translate(scene, "block", {-0.3, 1, 0.5}, at(corner)), 0.02},
      {"vertex within a surface", translate(scene, "panel", {-1, 0, 0.3}, at(middle)), 0.01},
      {"albedo", change_material(scene, glass ? "grey" : "block", "albedo"), 0.01, false}};
  if (glass)
    parameters.push_back(
        {"ior", change_material(scene, "block", "ior"), 0.01, false, c.sampling == Sampling::ellipsoidal ? 2.0 : 1.0});
  const bool two_lobes = c.look == Look::retroreflecting || c.look == Look::plastic;
  if (c.look == Look::plastic)  // what it changes is little beside the noise of the finite differences
    parameters.push_back({"ior", change_material(scene, "block", "ior"), 0.01, false, 2.5, 0.5});
  if (two_lobes) parameters.push_back({"reflectance", change_material(scene, "block", "reflectance"), 0.01, false});
  // What roughness changes is little beside the noise of the finite differences, and of glass under ellipsoidal sampling beside our own,
  // rare and large: that is left out.
  const bool hidden_by_noise = glass && c.sampling == Sampling::ellipsoidal;
  if (c.look != Look::diffuse && !hidden_by_noise)
    parameters.push_back({"roughness", change_material(scene, "block", "roughness"), 0.01, false,
                          glass       ? 20.0
                          : two_lobes ? 2.5
                                      : 1.0,
                          glass       ? 4.0
                          : two_lobes ? 0.5
                                      : INFINITY});
  std::vector<Motion> motions;
  for (const Parameter& p : parameters) motions.push_back(p.motion);
  const TangentBasis basis = make_basis(scene, motions);
  const GateSet gates(c.shape, {5.0, 6.0});
  EstimatorOptions options;
  options.max_bounces = 3;
  options.sampling = c.sampling;
  options.guiding_samples = 32;
  const Renderer renderer(scene, gates, options, &basis);

  constexpr int kBatches = 32;
  const char* factor_text = std::getenv("ISOCHRON_TEST_SAMPLES");
  const int factor = factor_text ? std::atoi(factor_text) : 1;
  std::vector<std::vector<Estimate>> terms[3];
  for (int t = 0; t < 3; ++t)
    terms[t] = term_means(renderer, kTerms[t], basis.columns, 2, samples_of(kTerms[t], factor * c.samples), kBatches,
                          {131, 0, 0});
  const auto size_of = [&](std::size_t p) {
    double sum = 0;
    for (int g = 0; g < 2; ++g)
      for (const auto& term : terms) sum += term[p][g].mean * term[p][g].mean / 2;
    return std::sqrt(sum);
  };
  double motion_scale = 0;
  int motion_count = 0;
  for (std::size_t p = 0; p < parameters.size(); ++p)
    if (parameters[p].geometry) motion_scale = std::hypot(motion_scale, size_of(p)), ++motion_count;
  motion_scale /= std::sqrt(motion_count);

  const double limit = c.look == Look::diffuse ? 0.05 : c.look == Look::glass ? 0.5 : 0.15;
  EstimatorOptions reference_options = options;
  reference_options.sampling = Sampling::standard;
  for (std::size_t p = 0; p < parameters.size(); ++p) {
    const auto difference = finite_difference(scene, parameters[p].motion, parameters[p].step, gates, reference_options,
                                              factor * c.reference_samples, kBatches, {32, 0, 0});
    const double scale = parameters[p].geometry ? motion_scale : size_of(p);
    for (int g = 0; g < 2; ++g) {
      Estimate total;
      for (const auto& term : terms) {
        total.mean += term[p][g].mean;
        total.standard_error = std::hypot(total.standard_error, term[p][g].standard_error);
      }
      const double error = std::hypot(total.standard_error, difference[g].standard_error);
      EXPECT_LT(std::abs(z_score(total, difference[g])), student_limit(4, kBatches))
          << parameters[p].name << ", gate " << g << ": " << total.mean << " +- " << total.standard_error
          << ", finite difference " << difference[g].mean << " +- " << difference[g].standard_error;
      EXPECT_LT(total.standard_error,
                scatter_of_errors(kBatches) * parameters[p].own_slack * limit / std::sqrt(factor) * scale)
          << parameters[p].name << ", gate " << g;
      EXPECT_LT(error, scatter_of_errors(kBatches) * parameters[p].slack * limit / std::sqrt(factor) * scale)
          << parameters[p].name << ", gate " << g << ": ours " << total.standard_error << ", finite difference "
          << difference[g].standard_error;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, FiniteDifference,
    ::testing::Values(
        DifferenceCase{"diffuse_gaussian_standard", Look::diffuse, GateShape::gaussian(0.3), Sampling::standard, 86,
                       92},
        DifferenceCase{"diffuse_boxcar_standard", Look::diffuse, GateShape::boxcar(0.6), Sampling::standard, 60, 400},
        DifferenceCase{"diffuse_truncated_ellipsoidal", Look::diffuse, GateShape::truncated_gaussian(0.3, 0.3),
                       Sampling::ellipsoidal, 32, 322},
        DifferenceCase{"diffuse_bins_standard", Look::diffuse, kBin, Sampling::standard, 57, 60},
        DifferenceCase{"diffuse_bins_ellipsoidal", Look::diffuse, kBin, Sampling::ellipsoidal, 80, 166},
        DifferenceCase{"diffuse_modulated_standard", Look::diffuse, GateShape::modulated(1.5), Sampling::standard, 120,
                       125},
        DifferenceCase{"glossy_gaussian_ellipsoidal", Look::glossy, GateShape::gaussian(0.3), Sampling::ellipsoidal, 30,
                       62},
        DifferenceCase{"glossy_boxcar_ellipsoidal", Look::glossy, GateShape::boxcar(0.6), Sampling::ellipsoidal, 30,
                       150},
        DifferenceCase{"glossy_truncated_standard", Look::glossy, GateShape::truncated_gaussian(0.3, 0.3),
                       Sampling::standard, 34, 115},
        DifferenceCase{"retroreflecting_gaussian_standard", Look::retroreflecting, GateShape::gaussian(0.3),
                       Sampling::standard, 29, 60},
        DifferenceCase{"retroreflecting_boxcar_ellipsoidal", Look::retroreflecting, GateShape::boxcar(0.6),
                       Sampling::ellipsoidal, 40, 200},
        DifferenceCase{"plastic_gaussian_standard", Look::plastic, GateShape::gaussian(0.3), Sampling::standard, 37,
                       74},
        DifferenceCase{"plastic_boxcar_ellipsoidal", Look::plastic, GateShape::boxcar(0.6), Sampling::ellipsoidal, 40,
                       200},
        DifferenceCase{"glass_gaussian_standard", Look::glass, GateShape::gaussian(0.3), Sampling::standard, 48, 101},
        DifferenceCase{"glass_boxcar_ellipsoidal", Look::glass, GateShape::boxcar(0.6), Sampling::ellipsoidal, 60,
                       125}),
    [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace isochron::testing
