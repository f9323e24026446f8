// Coarse levels that adam fits.
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/base/yaml_reader.h"
#include "optim/run/levels.h"
#include "tests/optim/levels_fixture.h"

namespace isochron {
namespace {

/// Adam fits coarse levels but the first, which knows no scale yet, and the last, of which evidence is taken: with its own weight of slopes and twice
/// the samples of the gradient. The others are the experiment's.
TEST_F(LevelsTest, CoarseLevelsGoOnByAdam) {
  const Problem problem(load_experiment(experiment("hill", "target: 0", "{samples: 256}")));
  write_exr(folder_.file("target.exr"), problem.make_target(kGoOn), {});
  const Experiment asked = load_experiment(experiment(
      "flat",
      "smoothing: {slopes: 0.01}, remesh: {levels: 4, coarse_levels: 3, edge_length: 0.5, adam: {iterations: "
      "10, learning_rate: 0.02, slopes: 1e-4}}",
      "{images: target.exr}"));
  EXPECT_EQ(start_run(asked, options()), RunStatus::iterations_reached);
  for (const int level : {1, 2, 3, 4}) {
    SCOPED_TRACE(level);
    const std::string folder = folder_.file("out/levels/" + std::to_string(level));
    const Experiment one = load_experiment(folder + "/experiment.yaml");
    const bool adam = level == 2;
    EXPECT_EQ(one.optimizer.method, adam ? OptimizerMethod::adam : OptimizerMethod::quasi_newton);
    EXPECT_EQ(one.optimizer.iterations, adam ? 10 : 4);
    EXPECT_EQ(one.parameters[0].slopes, adam ? 1e-4 : 0.01);
    EXPECT_EQ(one.samples.primal, 32);
    EXPECT_EQ(one.samples.interior, adam ? 64 : 32);
    EXPECT_EQ(one.target.histograms, 0) << "a camera";
    EXPECT_EQ(one.parameters[0].tangential, 0) << "no likelihood";
    if (adam) {
      EXPECT_EQ(one.optimizer.learning_rate, 0.02);
      EXPECT_EQ(one.optimizer.window(), 0);
      EXPECT_NEAR(one.optimizer.decay.factor(10), 1.0 / 64, 1e-12);
    }
  }
  YamlMap summary = open_yaml(folder_.file("out/levels/2/summary.yaml")).map();
  EXPECT_LT(summary.require("loss_final").number(), summary.require("loss_initial").number());

  Experiment counts = asked;
  counts.loss.kind = LossKind::poisson;
  counts.optimizer.iterations = 0;
  RunOptions elsewhere = options();
  elsewhere.folder = folder_.file("counts");
  start_run(counts, elsewhere);
  for (const int level : {1, 2, 3, 4}) {
    const Experiment one = load_experiment(folder_.file("counts/levels/" + std::to_string(level) + "/experiment.yaml"));
    EXPECT_EQ(one.parameters[0].tangential, level == 2 ? 200 : 0) << level;
  }
}

/// Of steps that are far too long: alone, the level's experiment warns that the loss rises.
TEST_F(LevelsTest, LevelsByAdamDoNotWarn) {
  const Problem problem(load_experiment(experiment("hill", "target: 0", "{samples: 256}")));
  write_exr(folder_.file("target.exr"), problem.make_target(kGoOn), {});
  std::vector<std::string> warnings;
  RunOptions both = options();
  both.warning = [&](const std::string& text) { warnings.push_back(text); };
  start_run(load_experiment(experiment("flat",
                                       "remesh: {levels: 4, coarse_levels: 3, edge_length: 0.5, adam: {iterations: 20, "
                                       "learning_rate: 0.5, slopes: 1e-9}}",
                                       "{images: target.exr}")),
            both);
  EXPECT_TRUE(warnings.empty()) << warnings.front();
  both.folder = folder_.file("alone");
  start_run(load_experiment(folder_.file("out/levels/2/experiment.yaml")), both);
  EXPECT_FALSE(warnings.empty());
}

TEST(Remesh, AdamWaitsForAlbedosBehindAnOutline) {
  RemeshSpec spec{.levels = 7, .coarse_levels = 6, .adam_iterations = 5};
  const auto by_adam = [&] {
    std::string levels;
    for (int level = 1; level <= spec.levels; ++level)
      if (spec.steps_by_adam(level)) levels += std::to_string(level);
    return levels;
  };
  EXPECT_EQ(by_adam(), "2345");
  spec.outline = 0.3;
  EXPECT_EQ(by_adam(), "345");
  spec.levels = 6;
  EXPECT_EQ(by_adam(), "345") << "the last of all is the optimiser's";
  spec.adam_iterations = 0;
  EXPECT_EQ(by_adam(), "");
}

}  // namespace
}  // namespace isochron
