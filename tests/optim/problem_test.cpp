// What a problem makes of detector and window together.
//
// Statistics: z-tests at 4.5 standard errors of 300 iterations (false alarms: 7e-6 each, 5e-5 for the file).
#include "optim/problem/problem.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <type_traits>

#include "tests/optim/tiny_scene.h"
#include "tests/seed.h"

namespace isochron {
namespace {

// Its parameters and kept scenes refer to its scene.
static_assert(!std::is_move_constructible_v<Problem> && !std::is_move_assignable_v<Problem>);
static_assert(!std::is_copy_constructible_v<Problem> && !std::is_copy_assignable_v<Problem>);

/// Gain, background and time offset at once, where one of two gates counts: the gradient of the mean square of
/// the residuals that count, from long renderings. Gain and background change an image as they stand in it, the time offset
/// is known by its finite difference with common random numbers.
TEST(Problem, GradientOfDetectorUnderAWindow) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("detector.yaml", tiny_experiment());
  const auto sampled = [&](const std::string& sampling) {
    return Problem(load_experiment(
        file, {"parameters=[{name: gain, type: gain, initial: 1.3, target: 1}, {name: dark, type: background, initial: "
               "0.05, target: 0}, {name: late, type: time_offset, initial: 0.07, target: 0}]",
               "target.window=[5, 6]", "estimator={sampling: " + sampling + "}"}));
  };
  // Paths by standard sampling do not change with the offset, so that the difference has no noise of its own.
  const Problem standard = sampled("standard");
  const std::vector<double> theta = standard.parameters().initial();
  GatedImage target = standard.make_target();
  // The first gate is outside of the window.
  for (int p = 0; p < 64; ++p) target.at(p, 0) = std::numeric_limits<double>::quiet_NaN();
  const auto render = [&](double late) {
    return standard.render({theta[0], theta[1], late}, {test_seed(31), 0, 0}, {0, 8192});
  };
  constexpr double kStep = 1e-3;
  const GatedImage image = render(theta[2]), above = render(theta[2] + kStep), below = render(theta[2] - kStep);
  double expected[3] = {0, 0, 0};
  for (int p = 0; p < 64; ++p) {
    const double slope = 2 * (image.at(p, 1) - target.at(p, 1)) / 64;
    expected[0] += slope * (image.at(p, 1) - theta[1]) / theta[0];
    expected[1] += slope;
    expected[2] += slope * (above.at(p, 1) - below.at(p, 1)) / (2 * kStep);
  }

  for (const char* sampling : {"standard", "ellipsoidal"}) {
    const Problem problem = sampled(sampling);
    constexpr int kIterations = 300;
    double sum[3] = {0, 0, 0}, squares[3] = {0, 0, 0};
    for (int i = 0; i < kIterations; ++i) {
      const Evaluation at = problem.evaluate(theta, target, test_seed(i));
      for (int k = 0; k < 3; ++k) sum[k] += at.gradient[k], squares[k] += at.gradient[k] * at.gradient[k];
    }
    for (int k = 0; k < 3; ++k) {
      const double mean = sum[k] / kIterations;
      const double error = std::sqrt((squares[k] / kIterations - mean * mean) / (kIterations - 1));
      EXPECT_LT(std::abs(mean - expected[k]), 4.5 * error + 0.01 * std::abs(expected[k]))
          << sampling << " " << k << ": " << mean << " +- " << error << ", expected " << expected[k];
      EXPECT_LT(error, 0.05 * std::abs(expected[k])) << sampling << " " << k;
    }
  }
}

}  // namespace
}  // namespace isochron
