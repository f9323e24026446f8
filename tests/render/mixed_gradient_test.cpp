// Gradients of a loss whose gates overlap and count unevenly, with light subpaths and by ellipsoidal connections. How often connections
// serve a gate, and samples a pixel, then enters the weights.
//
// Statistics: z-tests at 4.5 standard errors (false alarms: 7e-6 each, 3e-5 for the file) of a difference that is known to 2 % of
// the gradient: a technique that takes a third of it and is dropped or counts twice stands out by 15 of them.
#include <gtest/gtest.h>

#include "core/techniques/gate_pick.h"
#include "support.h"
#include "tests/seed.h"

namespace isochron::testing {
namespace {

/// Gates count ten times less from one to the next, pixels by their place; a tenth of the readings does not count.
GatedImage overlapping_adjoint(int width, int height, int gates) {
  GatedImage adjoint(width, height, gates, 1);
  Rng rng(Stream{test_seed(7), 0, 0}, 0, 0);
  for (int pixel = 0; pixel < adjoint.pixels(); ++pixel)
    for (int g = 0; g < gates; ++g) {
      const double u = rng.uniform();
      adjoint.at(pixel, g) = u < 0.1 ? 0 : (0.2 + u) * (1 + pixel % width) * std::pow(10.0, -g);
    }
  return adjoint;
}

TEST(GatePick, LeavesMixedGradientsUnbiased) {
  Scene scene = load_scene(TEST_DATA "/validation/scene.yaml");
  scene.camera.width = scene.camera.height = 8;
  replace_material(scene, "panel", conductor(Rgb(0.7), 0.5, true));
  const TangentBasis basis = make_basis(scene, {translate(scene, "light", {0.4, 0, 0.3})});
  const GatedImage adjoint = overlapping_adjoint(8, 8, 3);
  for (const GateShape& shape : {GateShape::gaussian(0.3), GateShape::truncated_gaussian(0.3, 0.5)}) {
    const GateSet gates(shape, {5.0, 5.3, 5.6});
    const auto gradient = [&](const EstimatorOptions& options, int samples, std::uint32_t seed) {
      const Renderer renderer(scene, gates, options, &basis);
      Batches batches;
      for (int b = 0; b < 32; ++b) {
        std::vector<double> dofs(DofLayout(scene).size(), 0.0);
        renderer.add_gradient(Term::interior, adjoint, {test_seed(seed), 0, 0}, {b * samples, (b + 1) * samples}, dofs);
        batches.add(basis.transpose_apply(dofs)[0]);
      }
      return batches.estimate();
    };
    const Estimate exact = gradient({.max_bounces = 3, .sampling = Sampling::standard}, 96, 53);
    for (const auto& [connections, light] : {std::pair{false, 0.5}, {true, 0.0}, {true, 0.5}}) {
      EstimatorOptions options{.max_bounces = 3, .light = light};
      options.mix = SamplingMix{connections, connections};
      const Estimate ours = gradient(options, 48, 54);
      EXPECT_LT(std::abs(z_score(ours, exact)), 4.5)
          << (connections ? "connections" : "standard") << ", light " << light << ": " << ours.mean << " +- "
          << ours.standard_error << ", standard " << exact.mean << " +- " << exact.standard_error;
      EXPECT_LT(std::hypot(ours.standard_error, exact.standard_error), 0.02 * std::abs(exact.mean));
    }
  }
}

/// A table that draws no lengths has the pixels' rates all the same.
TEST(GatePick, RatesNeedNoTable) {
  const GateSet gates(GateShape::gaussian(0.3), {5.0, 5.3, 5.6});
  const GatedImage adjoint = overlapping_adjoint(8, 8, 3);
  const GatePick with(gates, {&adjoint, 1}, true, 1), without(gates, {&adjoint, 1}, false, 1);
  for (int pixel = 0; pixel < adjoint.pixels(); ++pixel) EXPECT_EQ(with.rate(pixel), without.rate(pixel)) << pixel;
}

}  // namespace
}  // namespace isochron::testing
