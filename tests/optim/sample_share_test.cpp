// How many samples steps of adam take.
#include "optim/solvers/sample_share.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optim/problem/rendered_objective.h"
#include "optim/run/loop.h"
#include "tests/optim/synthetic_objective.h"
#include "tests/optim/tiny_scene.h"
#include "tests/seed.h"

namespace isochron {
namespace {

/// A signal that stays, of 1 for each unknown, and normal noise of that variance where all samples are taken.
class Gradients {
 public:
  Gradients(int unknowns, double variance, unsigned seed) : gradient_(unknowns), variance_(variance), random_(seed) {}
  const std::vector<double>& of(int parts, double signal = 1) {
    std::normal_distribution<double> noise(0, std::sqrt(parts * variance_));
    for (double& g : gradient_) g = signal + noise(random_);
    return gradient_;
  }

 private:
  std::vector<double> gradient_;
  double variance_;
  std::mt19937 random_;
};

TEST(SampleShare, LeavesOutPartsWhileGradientsAgree) {
  SampleShare share(8);
  Gradients exact(3, 0, 1);
  for (int i = 0; i < 9; ++i) share.observe(exact.of(1));
  EXPECT_EQ(share.parts(), 1) << "of too few";
  share.observe(exact.of(1));
  EXPECT_EQ(share.parts(), 8);
  for (int i = 0; i < 40; ++i) share.observe(exact.of(8, i % 2 == 0 ? 1 : -1));
  EXPECT_EQ(share.parts(), 1) << "they turn";
}

/// A variance of 1/12 stays below a quarter with two parts, and not with four. 300 unknowns know that to some percent over ten gradients: of 300
/// seeds all choose two.
TEST(SampleShare, KeepsNoiseBelowAQuarter) {
  SampleShare share(8);
  Gradients noisy(300, 1 / 12.0, test_seed(7));
  for (int i = 0; i < 100; ++i) share.observe(noisy.of(share.parts()));
  EXPECT_EQ(share.parts(), 2);
}

/// Of 2000 runs of one unknown without a signal, each of 100 gradients, none left out samples: a rate of more than 0.0015 is excluded with 95 %,
/// and then 5 of 1000 are exceeded with probability 0.004.
TEST(SampleShare, TakesAllSamplesOfNoise) {
  int fooled = 0;
  for (unsigned run = 0; run < 1000; ++run) {
    SampleShare share(8);
    Gradients noise(1, 1, test_seed(11) + run);
    bool left_out = false;
    for (int i = 0; i < 100; ++i) {
      share.observe(noise.of(1, 0));
      left_out = left_out || share.parts() > 1;
    }
    fooled += left_out;
  }
  EXPECT_LE(fooled, 5);
}

TEST(SampleShare, GoesOnFromItsState) {
  Gradients noisy(2, 0.1, test_seed(3));
  SampleShare first(8);
  for (int i = 0; i < 13; ++i) first.observe(noisy.of(first.parts()));
  SampleShare second(8);
  second.restore(first.state());
  for (int i = 0; i < 30; ++i) {
    const std::vector<double> gradient = noisy.of(first.parts());
    first.observe(gradient);
    second.observe(gradient);
    EXPECT_EQ(first.parts(), second.parts());
  }
}

/// Remembers which parts it was asked for.
class Recording : public ExponentialFit {
 public:
  Evaluation evaluate(const std::vector<double>& theta, std::uint32_t iteration) const override {
    return evaluate_part(theta, iteration, 1);
  }
  Evaluation evaluate_part(const std::vector<double>& theta, std::uint32_t iteration, int parts) const override {
    asked.push_back(parts);
    return linearise(theta, iteration);
  }
  mutable std::vector<int> asked;
};

std::vector<int> parts_of_a_run(Checkpoint& state, int iterations) {
  const Recording fit;
  OptimizerSpec spec;
  spec.learning_rate = 0.01;
  spec.iterations = iterations;
  const Preconditioner none;
  const auto optimizer = make_optimizer(spec, none);
  LoopOptions options;
  options.iterations = iterations;
  options.row = [](const Evaluation&, const std::vector<double>&, bool) {};
  options.save = [] {};
  run_loop(fit, *optimizer, 0, options, state);
  return fit.asked;
}

TEST(SampleShare, AdamAsksForItAndEndsWithAllSamples) {
  Checkpoint whole, half;
  whole.theta = half.theta = {1, 0.2};
  const std::vector<int> asked = parts_of_a_run(whole, 24);
  std::vector<int> expected(10, 1);
  expected.insert(expected.end(), 14, 8);
  expected.push_back(1);  // of the result
  EXPECT_EQ(asked, expected);
  parts_of_a_run(half, 15);
  const std::vector<int> rest = parts_of_a_run(half, 24);
  EXPECT_EQ(rest, std::vector<int>(expected.begin() + 15, expected.end())) << "resumed";
  EXPECT_EQ(half.theta, whole.theta);
}

TEST(SampleShare, PartsAreTheFirstSamples) {
  TemporaryFolder folder;
  write_tiny_scene(folder);
  const Problem problem(load_experiment(folder.write(
      "tiny.yaml", replaced(tiny_experiment(), "interior: 16, visibility: 16", "interior: 8, visibility: 16"))));
  const GatedImage target = problem.make_target();
  const RenderedObjective objective(problem, target);
  const std::vector<double> theta = problem.parameters().initial();
  const auto expect_same = [](const Evaluation& a, const Evaluation& b) {
    EXPECT_EQ(a.gradient, b.gradient);
    EXPECT_EQ(a.loss, b.loss);
  };
  expect_same(objective.evaluate_part(theta, 3, 1), objective.evaluate(theta, 3));
  expect_same(objective.evaluate_part(theta, 3, 4), problem.evaluate(theta, target, 3, {0, 4}));
  expect_same(objective.evaluate_part(theta, 3, 64), problem.evaluate(theta, target, 3, {0, 8}));
}

}  // namespace
}  // namespace isochron
