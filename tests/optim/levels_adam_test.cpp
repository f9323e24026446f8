// Coarse levels that adam fits.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstring>
#include <string>
#include <vector>

#include "core/base/yaml_reader.h"
#include "core/scene/scene_loader.h"
#include "optim/remesh/remesh.h"
#include "optim/run/levels.h"
#include "optim/run/next_level.h"
#include "optim/run/summary.h"
#include "tests/optim/levels_fixture.h"

namespace isochron {
namespace {

/// Adam fits coarse levels but the first, which knows no scale yet, and the last, of which evidence is taken: with its own weight of slopes and twice
/// the samples of the gradient. The others are the experiment's.
TEST_F(LevelsTest, CoarseLevelsGoOnByAdam) {
  const Problem problem(load_experiment(experiment("hill", "target: 0", "{samples: 256}")));
  write_exr(folder_.file("target.exr"), problem.make_target(), {});
  const Experiment asked = load_experiment(experiment(
      "flat",
      "smoothing: {slopes: 0.01}, remesh: {levels: 4, coarse_levels: 3, edge_length: 0.5, adam: {iterations: "
      "9, learning_rate: 0.02, slopes: 1e-4}}",
      "{images: target.exr}"));
  EXPECT_EQ(start_run(asked, options()), RunStatus::iterations_reached);
  for (const int level : {1, 2, 3, 4}) {
    SCOPED_TRACE(level);
    const std::string folder = folder_.file("out/levels/" + std::to_string(level));
    const Experiment one = load_experiment(folder + "/experiment.yaml");
    const bool adam = level == 2;
    EXPECT_EQ(one.optimizer.method, adam ? OptimizerMethod::adam : OptimizerMethod::quasi_newton);
    EXPECT_EQ(one.optimizer.iterations, adam ? 9 : 4);
    EXPECT_EQ(one.parameters[0].slopes, adam ? 1e-4 : 0.01);
    EXPECT_EQ(one.samples.primal, 32);
    EXPECT_EQ(one.samples.interior, adam ? 64 : 32);
    EXPECT_EQ(one.target.histograms, 0) << "a camera";
    EXPECT_EQ(one.parameters[0].tangential, 0) << "no likelihood";
    if (adam) {
      EXPECT_EQ(one.optimizer.learning_rate, 0.01);
      EXPECT_EQ(one.optimizer.window(), 0);
      EXPECT_NEAR(one.optimizer.decay.factor(9), 1.0 / 64, 1e-12);
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
  write_exr(folder_.file("target.exr"), problem.make_target(), {});
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

TEST(Remesh, EdgesAreHalvedBehindTheCoarseLevels) {
  RemeshSpec spec{.levels = 6, .coarse_levels = 4};
  const auto halvings = [&] {
    std::string each;
    for (int level = 1; level <= spec.levels; ++level) each += std::to_string(spec.halvings(level));
    return each;
  };
  EXPECT_EQ(halvings(), "000012");
  spec.adam_iterations = 5;
  EXPECT_EQ(halvings(), "001112") << "the third is adam's last";
}

/// Steps shrink in the last level by adam alone, even if a run ends before its coarse levels do. It has
/// iterations of its own. The last coarse ones have edges and steps of half the length.
TEST_F(LevelsTest, AdamsStepsShrinkOnceInTheEnd) {
  const Problem problem(load_experiment(experiment("hill", "target: 0", "{samples: 256}")));
  write_exr(folder_.file("target.exr"), problem.make_target(), {});
  const auto run = [&](int levels) {
    RunOptions anew = options();
    anew.force = true;
    start_run(load_experiment(experiment("flat",
                                         fmt::format("remesh: {{levels: {}, coarse_levels: 4, edge_length: 0.5, adam: "
                                                     "{{iterations: 9, last: 18, learning_rate: 0.01, slopes: 1e-9}}}}",
                                                     levels),
                                         "{images: target.exr}")),
              anew);
  };
  run(4);
  const auto adam = [&](int level) {
    return load_experiment(folder_.file(fmt::format("out/levels/{}/experiment.yaml", level))).optimizer;
  };
  EXPECT_EQ(adam(2).iterations, 9);
  EXPECT_EQ(adam(2).decay.factor(8), 1);
  EXPECT_EQ(adam(3).iterations, 18);
  EXPECT_EQ(adam(3).decay.factor(6), 1);
  EXPECT_NEAR(adam(3).decay.factor(16), 1.0 / 32, 1e-12);
  const auto edge = [&](int level) {
    return mean_edge_length(
        mesh_of(load_scene(folder_.file(fmt::format("out/levels/{}/scene/scene.yaml", level))), "hill"));
  };
  EXPECT_EQ(adam(2).learning_rate, 0.01);
  EXPECT_EQ(adam(3).learning_rate, 0.005);
  EXPECT_NEAR(edge(3) / edge(2), 0.5, 0.1);
  EXPECT_NEAR(edge(4) / edge(3), 1, 0.1);
  run(2);
  EXPECT_LT(adam(2).decay.factor(16), 0.1);
}

/// The last property of a binary PLY file's vertices, which have so many, all of them doubles.
std::vector<double> last_property(const std::string& ply, int doubles) {
  const std::string vertices = "element vertex ", end = "end_header\n";
  std::vector<double> values(std::stoi(ply.substr(ply.find(vertices) + vertices.size())));
  const char* data = ply.data() + ply.find(end) + end.size();
  for (std::size_t v = 0; v < values.size(); ++v)
    std::memcpy(&values[v], data + 8 * (doubles * (v + 1) - 1), sizeof(double));
  return values;
}

/// The last level alone states smaller errors than after the others. The difference of the squares is that of the distance to
/// the farthest of the surfaces that they have found. Levels keep a translation of the whole apart from their meshes.
TEST_F(LevelsTest, ErrorsCountHowFarLevelsAreApart) {
  const Problem problem(load_experiment(experiment("hill", "target: 0", "{samples: 256}")));
  write_exr(folder_.file("target.exr"), problem.make_target(), {});
  const std::string file = "/geometry/final_hill.ply";
  const std::string lift =
      "  - {name: lift, type: translation, shape: hill, direction: [0, 0, 1], initial: 0.02, target: 0.02}\n";
  for (const bool lifted : {false, true}) {
    SCOPED_TRACE(lifted);
    RunOptions run = options();
    run.force = true;
    start_run(
        load_experiment(experiment("flat",
                                   "smoothing: {bending: 0.01}, remesh: {levels: 4, coarse_levels: 4, edge_length: "
                                   "0.5, adam: {iterations: 5, learning_rate: 0.02, slopes: 1e-4}}",
                                   "{images: target.exr}", (lifted ? lift : "") + "loss: {kind: poisson}\n")),
        run);
    run.folder = folder_.file("alone");
    const Experiment last = load_experiment(folder_.file("out/levels/4/experiment.yaml"));
    start_run(last, run);
    Mesh found = read_mesh(folder_.file("out" + file));
    ASSERT_EQ(found.positions.size(), read_mesh(folder_.file("alone" + file)).positions.size());
    const std::vector<double> all = last_property(folder_.read("out" + file), 4),
                              own = last_property(folder_.read("alone" + file), 4);
    if (lifted) {
      const double by = final_values(folder_.file("out/summary.yaml"), Problem(last).parameters()).back();
      EXPECT_NE(by, 0);
      for (Vec3& p : found.positions) p.z -= by;
    }
    const std::vector<Vec3> normals = vertex_normals(scene_of(found));
    std::vector<double> apart(all.size(), 0.0);
    for (const char* level : {"2", "3", "4"}) {  // where they begin: what 1, 2 and 3 have found
      const Surface surface(read_mesh(folder_.file(std::string("out/levels/") + level + "/scene/surface.ply")));
      for (std::size_t v = 0; v < apart.size(); ++v)
        apart[v] = std::max(
            apart[v], length_squared(surface.closest(found.positions[v], normals[v]).position - found.positions[v]));
    }
    for (std::size_t v = 0; v < apart.size(); ++v) {
      EXPECT_GT(apart[v], 0.0) << v;
      EXPECT_NEAR(all[v] * all[v], own[v] * own[v] + apart[v], 1e-6 * all[v] * all[v]) << v;
    }
  }
}

/// The first level by adam begins with albedos that are 12 % lower than what the level before has found, unless they have a bound. In all
/// levels by adam albedos by vertex move together.
TEST_F(LevelsTest, AlbedosAreDimmedOnceForAdamAndMoveTogether) {
  const std::string remesh =
      "target: 0, remesh: {levels: 4, coarse_levels: 4, edge_length: 0.5, adam: {iterations: 1, "
      "learning_rate: 1e-9, slopes: 1e-9}}";
  const auto initial = [&](const std::string& more) {
    Experiment asked = load_experiment(experiment(
        "flat", remesh, "{samples: 4}",
        "  - {name: paint, type: albedo, shape: hill, per: vertex, initial: 0.5, target: 0.5" + more + "}\n"));
    asked.optimizer.iterations = 0;
    RunOptions run = options();
    run.force = true;
    start_run(asked, run);
    std::vector<double> firsts;
    for (int level = 1; level <= 4; ++level) {
      const ParameterSpec paint =
          load_experiment(folder_.file(fmt::format("out/levels/{}/experiment.yaml", level))).parameters[1];
      firsts.push_back(paint.initial[0]);
      EXPECT_EQ(paint.diffusion > 100, level == 2 || level == 3) << level;
    }
    return firsts;
  };
  const std::vector<double> found = initial("");
  EXPECT_EQ(found[0], 0.5);
  EXPECT_NEAR(found[1], 0.88 * 0.5, 1e-6);
  EXPECT_NEAR(found[2], 0.88 * 0.5, 1e-6);
  EXPECT_NEAR(found[3], 0.88 * 0.5, 1e-6);
  EXPECT_NEAR(initial(", lower: 0.48")[1], 0.5, 1e-6);
}

}  // namespace
}  // namespace isochron
