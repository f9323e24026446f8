// The whole chain from scene to loss gradient against central differences of the images.
#include <gtest/gtest.h>

#include <cmath>

#include "core/base/error.h"
#include "optim/problem/estimates.h"
#include "optim/problem/loss.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

TEST(Gradient, AgreesWithFiniteDifferences) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const std::vector<std::string> samples = {"samples={primal: 2048, interior: 2048, visibility: 2048, path_length: 0}",
                                            "parameters[1].initial=2"};
  const Problem analytic(load_experiment(file, samples));
  std::vector<std::string> with_method = samples;
  with_method.push_back("gradient={method: finite_difference, step: 0.01}");
  const Problem differences(load_experiment(file, with_method));
  const GatedImage target = analytic.make_target();
  const std::vector<double> theta = analytic.parameters().initial();
  const GradientEstimate a = estimate_gradient(analytic, theta, target);
  const GradientEstimate b = estimate_gradient(differences, theta, target);
  ASSERT_EQ(a.gradient.replicates, kMostReplicates);
  for (int i = 0; i < 2; ++i) {
    // Student's t of 7 degrees of freedom exceeds 8 with probability 9e-5.
    const double error = std::hypot(a.gradient.standard_error[i], b.gradient.standard_error[i]);
    EXPECT_LT(std::abs(a.gradient.mean[i] - b.gradient.mean[i]), 8 * error)
        << analytic.parameters().component_names()[i];
    // The test must be able to see a wrong factor.
    EXPECT_GT(std::abs(b.gradient.mean[i]), 12 * error) << analytic.parameters().component_names()[i];
  }
}

TEST(Gradient, DifferencesOfIndependentImagesAreAsRightAndNoisier) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const auto estimate = [&](const std::string& method) {
    const Problem problem(load_experiment(file, {"samples={primal: 512, interior: 0, visibility: 0, path_length: 0}",
                                                 "parameters[1].initial=2", method}));
    return estimate_gradient(problem, problem.parameters().initial(), problem.make_target()).gradient;
  };
  const auto common = estimate("gradient={method: finite_difference, step: 0.05}"),
             independent = estimate("gradient={method: finite_difference, step: 0.05, common_numbers: false}");
  for (int i = 0; i < 2; ++i) {
    // Student's t of 7 degrees of freedom exceeds 8 with probability 9e-5.
    EXPECT_NEAR(common.mean[i], independent.mean[i],
                8 * std::hypot(common.standard_error[i], independent.standard_error[i]));
  }
  // By the emission, in proportion to which images are: common numbers leave next to none of their noise.
  EXPECT_GT(independent.standard_error[1], 3 * common.standard_error[1]);
}

TEST(Gradient, OfAnEmissionIsKnown) {
  // Radiance is linear in the lamp's emission e: dI/de = I / e, so dLoss/de = (2/N) sum (I - T) I / e.
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const Problem problem(load_experiment(
      file, {"samples={primal: 1024, interior: 1024, visibility: 0, path_length: 0}", "parameters[1].initial=2"}));
  const GatedImage target = problem.make_target();
  const std::vector<double> theta = problem.parameters().initial();
  const GradientEstimate estimate = estimate_gradient(problem, theta, target);
  const GatedImage image = problem.render(theta, {99, 0, 0}, {0, 8192});
  const double expected = inner_product(loss_adjoint(image, target), image) / theta[1];
  const double error = estimate.gradient.standard_error[1];
  EXPECT_NEAR(estimate.gradient.mean[1], expected, 8 * error + 0.01 * std::abs(expected));  // of 7 degrees: 9e-5
  EXPECT_GT(std::abs(expected), 12 * error);
}

TEST(Gradient, ResidualAndDerivativeAreIndependent) {
  // At the target, with one sample per pixel, all that is left of the residual is noise. The gradient
  // averages to zero, but to 2 Var(I) / e for the emission e if residual and derivative came from the same
  // random numbers; the mean square of the residual there is Var(I).
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const Problem problem(load_experiment(
      file, {"samples={primal: 1, interior: 1, visibility: 0, path_length: 0}", "target.samples=16384"}));
  const GatedImage target = problem.make_target();
  const std::vector<double> theta = problem.parameters().target();
  ReplicateStatistics statistics;
  for (std::uint32_t i = 0; i < 1000; ++i) {
    const Evaluation e = problem.evaluate(theta, target, i);
    GatedImage residual = e.image;
    for (std::size_t k = 0; k < residual.data.size(); ++k) residual.data[k] -= target.data[k];
    statistics.add({e.gradient[1], mean_square(residual)}, 1);
  }
  const Statistics result = statistics.result();
  const double bias_if_shared = 2 * result.mean[1] / theta[1];
  EXPECT_GT(bias_if_shared, 10 * result.standard_error[0]);
  EXPECT_LT(std::abs(result.mean[0]), 5 * result.standard_error[0]);  // false alarms: 6e-7
}

TEST(Gradient, ReplicatesOfALikelihoodHaveTwoHalvesEach) {
  const TemporaryFolder folder;
  write_tiny_scene(folder);
  const std::string file = folder.write("tiny.yaml", tiny_experiment());
  const auto replicates = [&](int primal) {
    const Problem problem(load_experiment(
        file, {"loss={kind: poisson}", "samples={primal: " + std::to_string(primal) + ", interior: 16}"}));
    const auto theta = problem.parameters().initial();
    return estimate_gradient(problem, theta, problem.make_target()).gradient.replicates;
  };
  EXPECT_EQ(replicates(8), 4);
  EXPECT_EQ(replicates(5), 2);
  EXPECT_THROW(replicates(3), InputError);
}

TEST(ReplicateStatistics, WeightsReplicatesByTheirSamples) {
  ReplicateStatistics statistics;
  statistics.add({1.0}, 1);
  statistics.add({4.0}, 2);
  statistics.add({2.0}, 1);
  const Statistics result = statistics.result();
  EXPECT_NEAR(result.mean[0], 2.75, 1e-15);
  // sqrt(3/2 * (0.25^2 * 1.75^2 + 0.5^2 * 1.25^2 + 0.25^2 * 0.75^2))
  EXPECT_NEAR(result.standard_error[0], std::sqrt(1.5 * (0.19140625 + 0.390625 + 0.03515625)), 1e-15);
}

}  // namespace
}  // namespace isochron
