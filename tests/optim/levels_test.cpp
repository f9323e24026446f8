// Runs in levels: what is carried over, and what happens between levels.
#include "optim/run/levels.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "core/base/yaml_reader.h"
#include "core/scene/scene_loader.h"
#include "optim/remesh/remesh.h"
#include "tests/optim/temporary_folder.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

/// Between vertices half a unit apart, linear heights miss the hill by up to (pi / 2)^2 of its height over 8; a quarter of that
/// is left at half the distance. How far the first level comes is bounded by what it cannot represent.
TEST_F(LevelsTest, AFinerLevelComesNearerToTheTruth) {
  write_target();
  std::string report;
  RunOptions run = options();
  run.report = [&](const std::string& text) { report = text; };
  start_run(load_experiment(experiment("flat", "remesh: {levels: 2}", "{images: hill.exr}")), run);
  const Mesh first = found("out/levels/1"), second = found("out/levels/2");
  EXPECT_EQ(first.positions.size(), 25u);
  EXPECT_GT(second.positions.size(), 60u);
  EXPECT_NEAR(mean_edge_length(second), mean_edge_length(first) / 2, 0.05);
  EXPECT_LT(distance(first), 0.2 * distance(read_mesh(folder_.file("flat.obj"))));
  EXPECT_LT(distance(second), 0.6 * distance(first));
  EXPECT_EQ(found("out").positions, second.positions);
  EXPECT_EQ(folder_.read("out/final.exr"), folder_.read("out/levels/2/final.exr"));
  EXPECT_EQ(folder_.read("out/initial.exr"), folder_.read("out/levels/1/initial.exr"));
  EXPECT_NE(report.find("edge length"), std::string::npos);

  YamlMap summary = open_yaml(folder_.file("out/summary.yaml")).map();
  const std::vector<YamlValue> levels = summary.require("levels").list();
  ASSERT_EQ(levels.size(), 2u);
  double losses[2];
  for (int i = 0; i < 2; ++i) {
    YamlMap level = levels[i].map();
    EXPECT_EQ(level.require("vertices").integer(0, 1000),
              static_cast<long long>((i ? second : first).positions.size()));
    losses[i] = level.require("loss").number();
    level.require("status").text();
  }
  EXPECT_LT(losses[1], losses[0]);
}

TEST_F(LevelsTest, TheFirstLevelMayBeRemeshed) {
  write_target();
  start_run(load_experiment(experiment("flat", "remesh: {levels: 1, edge_length: 0.3}", "{images: hill.exr}")),
            options());
  EXPECT_NEAR(mean_edge_length(found("out")), 0.3, 0.03);
  EXPECT_FALSE(folder_.has("out/geometry/target_hill.ply")) << "nobody knows it";
}

TEST_F(LevelsTest, CoarseLevelsKeepTheLengthOfEdges) {
  write_target();
  start_run(load_experiment(
                experiment("flat", "remesh: {levels: 3, coarse_levels: 2, edge_length: 0.4}", "{images: hill.exr}")),
            options());
  EXPECT_NEAR(mean_edge_length(found("out/levels/1")), 0.4, 0.04);
  EXPECT_NEAR(mean_edge_length(found("out/levels/2")), 0.4, 0.04);
  EXPECT_NEAR(mean_edge_length(found("out/levels/3")), 0.2, 0.02);
}

TEST_F(LevelsTest, EachHasRandomNumbersOfItsOwn) {
  write_target();
  const Experiment all = load_experiment(
      experiment("flat", "remesh: {levels: 3, coarse_levels: 3, edge_length: 0.8}", "{images: hill.exr}"));
  start_run(all, options());
  std::set<std::uint64_t> seeds;
  for (int level = 1; level <= 3; ++level)
    seeds.insert(load_experiment(folder_.file("out/levels/" + std::to_string(level) + "/experiment.yaml")).seed);
  EXPECT_EQ(seeds.size(), 3u);
  EXPECT_TRUE(seeds.contains(all.seed));
}

/// Levels that have ended have brought what they have, and do not bring it again over what later ones found.
TEST_F(LevelsTest, ResumingLeavesWhatLaterLevelsFound) {
  write_target();
  start_run(load_experiment(experiment("flat", "remesh: {levels: 3}", "{images: hill.exr}")), options());
  const auto found = [&] { return folder_.read("out/final.exr") + folder_.read("out/geometry/final_hill.ply"); };
  const std::string whole = found();
  RunOptions again = options();
  int rows = 0;
  again.row = [&](const LogRow&, const std::vector<double>&, const Evaluation&, bool) {
    ++rows;
    EXPECT_TRUE(found() == whole);
  };
  resume_run(again);
  EXPECT_GT(rows, 0);
  EXPECT_TRUE(found() == whole);
}

/// Everything begins where it was found: the same surface, albedos, gain and shift; the image is that of before.
TEST_F(LevelsTest, EverythingIsCarriedOver) {
  std::string albedos;
  const Mesh mesh = read_mesh(folder_.file("flat.obj"));
  const auto albedo = [](const Vec3& p) { return 0.5 + 0.2 * p.x - 0.1 * p.y; };
  for (const Vec3& p : mesh.positions) albedos += std::to_string(albedo(p)) + " ";
  folder_.write("albedos.txt", albedos);
  const std::string file =
      experiment("flat", "remesh: {levels: 2}, target: 0, lower: -0.3, upper: 0.5", "{samples: 16}",
                 "  - {name: paint, type: albedo, per: vertex, shape: hill, initial: albedos.txt, target: 0.5}\n"
                 "  - {name: shift, type: translation, shape: hill, direction: [1, 0, 0], initial: 0.1, target: 0}\n"
                 "  - {name: gain, type: gain, initial: 2, target: 1}\n");
  const Problem problem(load_experiment(file));
  const ParameterSpec& remeshed = *remeshed_parameter(problem.experiment());
  std::vector<double> theta = problem.parameters().initial();
  const auto height = [](const Vec3& p) { return 0.1 * p.x + 0.02 * p.y; };
  for (std::size_t v = 0; v < mesh.positions.size(); ++v) theta[v] = height(mesh.positions[v]);
  theta.back() = 3;
  const LevelSurface surface = remeshed_surface(found_surface(problem, theta, remeshed), 0.25);
  const std::vector<ParameterSpec> next = next_parameters(problem, theta, remeshed, surface);
  const std::size_t vertices = surface.mesh.positions.size();
  EXPECT_GT(vertices, 60u);
  EXPECT_EQ(next[0].initial, std::vector<double>{0});
  EXPECT_TRUE(next[0].target.empty());
  EXPECT_EQ(next[0].remesh.levels, 0);
  ASSERT_EQ(next[0].lower.size(), vertices);
  ASSERT_EQ(next[1].initial.size(), vertices);
  EXPECT_EQ(next[1].target, std::vector<double>{0.5});
  for (std::size_t v = 0; v < vertices; ++v) {
    const Vec3& p = surface.mesh.positions[v];
    EXPECT_NEAR(p.z, height(p), 1e-6);  // files hold six decimals
    EXPECT_NEAR(next[0].lower[v], -0.3 - p.z, 1e-6);
    EXPECT_NEAR(next[0].upper[v], 0.5 - p.z, 1e-6);
    EXPECT_NEAR(next[1].initial[v], albedo(p), 1e-5);
  }
  EXPECT_EQ(next[2].initial, std::vector<double>{0.1});
  EXPECT_EQ(next[3].initial, std::vector<double>{3});
  EXPECT_EQ(next[3].scale, 2);
}

/// A fit may bring vertices to one place, by rounding: they go on as one, and with one value.
TEST_F(LevelsTest, VerticesAtOnePlaceAreOne) {
  LevelSurface surface;
  surface.mesh = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {1, 1 + 1e-15, 0}}, {{0, 1, 2}, {0, 4, 3}}};
  surface.fields.push_back({0, "initial", 2, {1, 10, 2, 20, 3, 30, 4, 40, 3 + 1e-14, 30}});
  const LevelSurface next = remeshed_surface(surface, 1.2);
  EXPECT_EQ(next.mesh.faces.size(), 2u);
  ASSERT_EQ(next.mesh.positions.size(), 4u);
  ASSERT_EQ(next.fields[0].values.size(), 8u);
  for (std::size_t v = 0; v < 4; ++v) {
    const Vec3& p = next.mesh.positions[v];
    EXPECT_EQ(next.fields[0].values[2 * v], p.y == 0 ? 1 + p.x : 4 - p.x);
    EXPECT_EQ(next.fields[0].values[2 * v + 1], 10 * next.fields[0].values[2 * v]);
  }
}

/// A sheet of twice the size: its first level becomes dark where the target has none, and the second has the size of the target.
TEST_F(LevelsTest, TheOutlineIsWhereAlbedosBecomeDark) {
  folder_.write("small.obj", "v -0.5 -1 0\nv 0.5 -1 0\nv 0.5 1 0\nv -0.5 1 0\nf 1 2 3\nf 1 3 4\n");
  folder_.write("small.yaml", [&] {
    std::string text = folder_.read("flat.yaml");
    return text.replace(text.find("flat.obj"), 8, "small.obj");
  }());
  const Problem problem(load_experiment(experiment("small", "target: 0", "{samples: 256}")));
  write_exr(folder_.file("target.exr"), problem.make_target(), {});
  const std::string albedo =
      "  - {name: paint, type: albedo, per: vertex, shape: hill, initial: 0.4, smoothing: {slopes: 10}}\n";
  const auto of = [&](const std::string& outline) {
    return load_experiment(experiment("flat", "remesh: {levels: 2, coarse_levels: 2, edge_length: 0.25" + outline + "}",
                                      "{images: target.exr}", albedo));
  };
  start_run(of(""), options());
  EXPECT_GT(surface_area(read_mesh(folder_.file("out/levels/2/geometry/initial_hill.ply"))), 3.9);
  start_run(of(", outline: {albedo: 0.5, slopes: 1e-6}"), options());
  const Mesh second = read_mesh(folder_.file("out/levels/2/geometry/initial_hill.ply"));
  EXPECT_NEAR(surface_area(second), 2, 0.3);
  for (const Vec3& p : second.positions) EXPECT_LT(std::abs(p.x), 0.75);
  const auto paint = [&](int level) {
    return load_experiment(folder_.file("out/levels/" + std::to_string(level) + "/experiment.yaml")).parameters[1];
  };
  EXPECT_EQ(paint(1).slopes, 1e-6);
  EXPECT_EQ(paint(2).slopes, 10);
  const std::vector<double> even = paint(2).initial;
  ASSERT_EQ(even.size(), second.positions.size());
  for (const double each : even) EXPECT_NEAR(each, even[0], 1e-9);
  EXPECT_NEAR(even[0], 0.5, 0.05);
}

/// A triangle of a thousandth of the edges beside the sheet: of the first level as it was loaded, and of no other.
TEST_F(LevelsTest, PartsThatShrankToNothingAreLeftOut) {
  folder_.write("flat.obj", sheet(4, flat) + "v 2 0 0\nv 2.001 0 0\nv 2 0.001 0\nf 26 27 28\n");
  const std::string albedo = "  - {name: paint, type: albedo, per: vertex, shape: hill, initial: 0.4, target: 0.5}\n";
  Experiment two =
      load_experiment(experiment("flat", "remesh: {levels: 2, coarse_levels: 2}, target: 0", "{samples: 4}", albedo));
  two.optimizer.iterations = 0;
  start_run(two, options());
  const auto widest = [&](const std::string& level) {
    double x = 0;
    for (const Vec3& p : found("out/levels/" + level).positions) x = std::max(x, p.x);
    return x;
  };
  EXPECT_GT(widest("1"), 2);
  EXPECT_NEAR(widest("2"), 1, 1e-12);
  EXPECT_EQ(load_experiment(folder_.file("out/levels/2/experiment.yaml")).parameters[1].initial.size(),
            found("out/levels/2").positions.size());
}

/// Eight cells each way without 2 x 5 near the middle of one side: a strip of one cell is left there. It is open in the next level where the outline
/// is to be found, and stays where a mesh says what it is.
TEST_F(LevelsTest, NarrowStripsAreCutWhereTheOutlineIsToBeFound) {
  const std::string whole = sheet(8, flat);
  std::size_t line = whole.find('f');
  std::string text = whole.substr(0, line);
  for (int face = 0; line < whole.size(); ++face) {
    const std::size_t next = whole.find('\n', line) + 1;
    const int x = face / 2 % 8, y = face / 16;
    if (!((x == 3 || x == 4) && y >= 1 && y < 6)) text += whole.substr(line, next - line);
    line = next;
  }
  folder_.write("flat.obj", text);
  const std::string albedo = "  - {name: paint, type: albedo, per: vertex, shape: hill, initial: 0.5, target: 0.5}\n";
  const auto lowest_in_the_middle = [&](const std::string& outline) {
    Experiment two = load_experiment(
        experiment("flat", "remesh: {levels: 2, coarse_levels: 2" + outline + "}, target: 0", "{samples: 4}", albedo));
    two.optimizer.iterations = 0;
    start_run(two, options());
    double y = 1;
    for (const Vec3& p : found("out/levels/2").positions)
      if (std::abs(p.x) < 0.2) y = std::min(y, p.y);
    return y;
  };
  EXPECT_EQ(lowest_in_the_middle(""), -1);
  EXPECT_NEAR(lowest_in_the_middle(", outline: {albedo: 0.5, slopes: 1e-6}"), 0.5, 1e-6);
}

/// Two vertices beyond their neighbours, one above them and one below: remeshing would leave such a fold as it is, as it passes through the
/// sheet. The second level begins without it.
TEST_F(LevelsTest, BeginWithoutFolds) {
  std::string text = sheet(12, flat);
  for (const auto& [y, z] : {std::pair{"0.000000", "0.03"}, {"0.166667", "-0.03"}})
    text = replaced(text, fmt::format("v 0.000000 {} 0.000000\n", y), fmt::format("v 0.283333 {} {}\n", y, z));
  folder_.write("flat.obj", text);
  Experiment two =
      load_experiment(experiment("flat", "remesh: {levels: 2, coarse_levels: 2}, target: 0", "{samples: 4}"));
  two.optimizer.iterations = 0;
  start_run(two, options());
  const auto turned_over = [&](const std::string& level) {
    const Mesh mesh = found("out/levels/" + level);
    return std::ranges::count_if(mesh.faces, [&](const std::array<int, 3>& f) {
      const Vec3& a = mesh.positions[f[0]];
      return cross(mesh.positions[f[1]] - a, mesh.positions[f[2]] - a).z < 0;
    });
  };
  EXPECT_GT(turned_over("1"), 0);
  EXPECT_EQ(turned_over("2"), 0);
}

/// The truth has one albedo, so that the data of a level determine far more than ten unknowns for each nat of the penalty.
TEST_F(LevelsTest, EvidenceChangesAWeightByTenAtMost) {
  write_target();
  const std::string more =
      "  - {name: paint, type: albedo, per: vertex, shape: hill, initial: 0.5, smoothing: {slopes: 1e-12, evidence: "
      "true}}\n"
      "loss: {kind: poisson}\n";
  start_run(load_experiment(experiment("hill", "remesh: {levels: 2, edge_length: 0.3}", "{images: hill.exr}", more)),
            options());
  EXPECT_NEAR(load_experiment(folder_.file("out/levels/2/experiment.yaml")).parameters[1].slopes, 1e-11, 1e-17);
}

TEST_F(LevelsTest, RefusesWhatCannotBeCarriedOver) {
  const auto of = [&](const std::string& remesh, const std::string& more = "") {
    return refusal(experiment("flat", remesh + ", target: 0", "{samples: 4}", more));
  };
  const auto says = [](const std::string& text, const std::string& what) {
    EXPECT_NE(text.find(what), std::string::npos) << text;
    EXPECT_NE(text.find("experiment.yaml:"), std::string::npos) << text;
  };
  says(of("remesh: {levels: 0}"), "remesh.levels");
  says(of("remesh: {edge_length: 0.1}"), "levels");
  says(of("remesh: {levels: 3, coarse_levels: 0}"), "remesh.coarse_levels");
  says(of("remesh: {levels: 2, size: 3}"), "remesh.size");
  says(of("remesh: {levels: 2, outline: {slopes: 1}}"), "remesh.outline.albedo");
  says(of("remesh: {levels: 2, outline: {albedo: 1.5}}"), "remesh.outline.albedo");
  says(of("remesh: {levels: 2, outline: {albedo: 0.5}}"), "outline: 'hill' has no albedos by vertex");
  says(of("remesh: {levels: 2, adam: {iterations: 5}}"), "remesh.adam.learning_rate");
  says(of("remesh: {levels: 2, adam: {iterations: 0, learning_rate: 0.1}}"), "remesh.adam.iterations");
  says(of("remesh: {levels: 3, coarse_levels: 2, adam: {iterations: 5, learning_rate: 0.1}}"),
       "adam: there is no coarse level for it");
  says(of("remesh: {levels: 2, coarse_histograms: 100}"), "belongs to captures");
  says(of("remesh: {levels: 2}, selection: [0, 1]"), "selection: is of vertices that remeshing replaces");
  says(of("remesh: {levels: 12, edge_length: 0.01}"), "triangles");
  says(
      of("remesh: {levels: 2}", "  - {name: r, type: rotation, shape: hill, axis: [0, 0, 1], initial: 0, target: 0}\n"),
      "'hill' is remeshed by 'z'");
  says(of("remesh: {levels: 2}", "  - {name: gain, type: gain, initial: 1, target: 1, remesh: {levels: 2}}\n"),
       "belongs to vertices");
  says(refusal(experiment("flat", "smoothing: {slopes: 1, evidence: true}, remesh: {levels: 2}, target: 0",
                          "{samples: 4}\nloss: {kind: poisson}\ngradient: {method: finite_difference, step: 0.01}")),
       "evidence needs products with the Jacobian");
  folder_.write("flat.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 2 5\n");
  says(of("remesh: {levels: 2}"), "the mesh of 'hill' is no manifold");
}

}  // namespace
}  // namespace isochron
