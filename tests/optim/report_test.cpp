#include "optim/run/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "optim/run/bounds.h"
#include "optim/run/fit.h"
#include "optim/run/summary.h"
#include "optim/run/zero_gradient.h"
#include "tests/optim/temporary_folder.h"

namespace isochron {
namespace {

class Report : public testing::Test {
 protected:
  Report() {
    scene_.materials.push_back(Material("diffuse", "wall"));
    scene_.materials.push_back(Material("diffuse", "thing"));
    state_.iteration = 12;
    state_.seconds = 3.25;
    state_.loss_initial = 0.5;
    state_.loss_noise_initial = 0.01;
    state_.image_rmse_initial = 0.7;
    state_.steps_rejected = 3;
    state_.safeguard.rejected = 1;
    for (int i = 0; i < 8; ++i) {
      state_.descent.recent.push_back(i % 2 == 0 ? 1 : -1);  // variance 8 / 7
      state_.descent.recent_noise.push_back(0.5);
    }
    last_.iteration = 13;  // of the average
    last_.loss = 1e-4;
    last_.loss_noise = 2e-4;
    last_.image_rmse = 0.01;
  }
  ParameterSpec albedo(const char* material, std::vector<double> initial, std::vector<double> target) const {
    ParameterSpec spec;
    spec.name = spec.material = material;
    spec.type = ParameterType::material;
    spec.quantity = "albedo";
    spec.initial = std::move(initial);
    spec.target = std::move(target);
    return spec;
  }
  Scene scene_;
  Checkpoint state_;
  LogRow last_;
};

TEST_F(Report, ShowsParametersErrorsAndNoise) {
  const Parameters parameters(scene_, {albedo("wall", {0.5}, {0.7}), albedo("thing", {0.25}, {})});
  state_.theta = {0.6875, 0.375};
  const std::string text = run_report({RunStatus::converged, FinalChoice::average}, state_, last_, parameters);
  EXPECT_EQ(text,
            "converged after 12 iterations, 3.25 s, 4 steps rejected; final parameters: average (row 13 of log.csv)\n"
            "  parameter        initial          found         target          error  initial error\n"
            "  wall                 0.5         0.6875            0.7        -0.0125           -0.2\n"
            "  thing               0.25          0.375              -              -              -\n"
            "  loss 0.0001 +- 0.0002 (at the start 0.5 +- 0.01): it cannot be told from 0\n"
            "  noise makes 22 % of the loss's variance over the 8 rows of log.csv up to row 12\n"
            "  image RMSE 0.01 (at the start 0.7)\n");

  const std::string summary = summary_yaml({RunStatus::converged, FinalChoice::average}, state_, last_, parameters);
  EXPECT_NE(summary.find("rejected_steps: 4\n"), std::string::npos) << summary;
  EXPECT_EQ(summary.find("standard_errors"), std::string::npos) << summary;
  EXPECT_NE(summary.find("loss_noise_initial: 0.01\nloss_noise_final: 0.0002\nnoise_share: 0.21875\n"),
            std::string::npos)
      << summary;
}

TEST_F(Report, TellsWhichUnknownsEndedAtABound) {
  ParameterSpec bounded = albedo("thing", {0.25}, {});
  bounded.lower = {0.125};
  bounded.upper = {0.375};
  const Parameters parameters(scene_, {albedo("wall", {0.5}, {0.7}), bounded});
  const auto screen = [&] { return run_report({}, state_, last_, parameters); };
  const auto summary = [&] { return summary_yaml({}, state_, last_, parameters); };
  state_.theta = {0.6875, 0.375};
  EXPECT_NE(screen().find("  thing ended at its upper bound 0.375\n"), std::string::npos) << screen();
  EXPECT_NE(summary().find("\nat_bounds:\n  thing:\n    upper: {bound: 0.375, count: 1, first: [0]}\n"),
            std::string::npos)
      << summary();
  state_.theta = {0.6875, 0.125 * (1 + 1e-15)};  // a mean of values at the bound, rounded
  EXPECT_NE(screen().find("  thing ended at its lower bound 0.125\n"), std::string::npos) << screen();
  state_.theta = {0.6875, 0.374};
  EXPECT_EQ(screen().find("bound"), std::string::npos);
  EXPECT_NE(summary().find("\nat_bounds: {}\n"), std::string::npos) << summary();
}

TEST_F(Report, BoundsOfManyUnknownsAreCounted) {
  scene_.materials[0] = Material("diffuse", "wall");
  scene_.grey = false;
  ParameterSpec colour = albedo("wall", {0.5}, {});
  const Parameters parameters(scene_, {colour});
  ASSERT_EQ(parameters.size(), 3);
  state_.theta = {1e-4, 1, 1e-4};
  const std::vector<AtBound> found = find_at_bounds(parameters, state_.theta);
  EXPECT_EQ(bounds_report(found),
            "  wall: 2 of 3 ended at their lower bound 0.0001 (0, 2)\n"
            "  wall: 1 of 3 ended at their upper bound 1 (1)\n");
  EXPECT_EQ(bounds_yaml(found),
            "at_bounds:\n  wall:\n    lower: {bound: 0.0001, count: 2, first: [0, 2]}\n"
            "    upper: {bound: 1, count: 1, first: [1]}\n");
}

/// A bound on one side alone leaves room.
TEST_F(Report, TellsWhichUnknownsEndedAtTheirOnlyBound) {
  ParameterSpec gain;
  gain.name = "gain";
  gain.type = ParameterType::gain;
  gain.initial = {2};
  gain.lower = {1};
  const Parameters parameters(scene_, {gain});
  ASSERT_TRUE(std::isinf(parameters.upper()[0]));
  EXPECT_EQ(bounds_report(find_at_bounds(parameters, {1})), "  gain ended at its lower bound 1\n");
  EXPECT_TRUE(find_at_bounds(parameters, {1.1}).empty());
}

/// Bounds that leave no room are a choice.
TEST_F(Report, UnknownsThatAreHeldAreNotAtBounds) {
  for (const double room : {0.0024, 0.0026}) {
    ParameterSpec held = albedo("wall", {0.5}, {});
    held.lower = {0.5};
    held.upper = {0.5 / (1 - room)};
    const Parameters parameters(scene_, {held});
    EXPECT_EQ(find_at_bounds(parameters, held.lower).size(), room < 0.0025 ? 0u : 1u);
    EXPECT_EQ(find_at_bounds(parameters, held.upper).size(), room < 0.0025 ? 0u : 1u);
  }
}

/// What a bound holds has no step left, unless the bound leaves room for more than the standard error.
TEST_F(Report, StepsThatBoundsCutAreNotLeft) {
  ParameterSpec bounded = albedo("wall", {0.5}, {});
  bounded.lower = {0.5};
  bounded.upper = {0.75};
  const Parameters parameters(scene_, {bounded});
  const auto is_left = [&](double theta, double step) {
    ParameterErrors errors;
    errors.values = {0.1};
    errors.steps_left = {{"wall", step}};
    drop_held_steps(parameters, {theta}, errors);
    return !errors.steps_left.empty();
  };
  EXPECT_FALSE(is_left(0.5, -0.2));
  EXPECT_FALSE(is_left(0.7, 0.2));
  EXPECT_TRUE(is_left(0.5, 0.2));
  EXPECT_TRUE(is_left(0.7, -0.2));
  EXPECT_TRUE(is_left(0.62, 0.2));
}

TEST_F(Report, SummaryHasErrorsAndCost) {
  const Parameters parameters(scene_, {albedo("wall", {0.5}, {0.7}), albedo("thing", {0.25}, {})});
  state_.theta = {0.6875, 0.375};
  const ParameterErrors errors{"gauss_newton_matrix",
                               {0.25, INFINITY},
                               {"thing"},
                               {{"wall * thing", {0.5, 0.75}, {0.125, 0.25}, 0.625, 0.0625}},
                               {{"wall", -0.5}}};
  const std::string summary =
      summary_yaml({}, state_, last_, parameters, {3, 1.5, 700, 2048, {{"primal", 0.75}, {"visibility", 0.5}}}, errors);
  EXPECT_NE(summary.find("standard_errors_from: gauss_newton_matrix\nstandard_errors:\n  wall: 0.25\n"
                         "  thing: .inf\n"
                         "undetermined: [\"thing\"]\n"
                         "steps_left:\n  \"wall\": -0.5\n"
                         "combinations:\n  wall * thing:\n    mean: 0.625\n    mean_standard_error: 0.0625\n"
                         "    values: [0.5, 0.75]\n    standard_errors: [0.125, 0.25]\n"
                         "last_call: {first_iteration: 3, seconds: 1.5, rays: 700, peak_memory_bytes: 2048, "
                         "passes: {primal: 0.75, visibility: 0.5}}\n"),
            std::string::npos)
      << summary;
  const std::string text = run_report({}, state_, last_, parameters, errors);
  EXPECT_NE(text.find("  the readings do not determine thing\n"
                      "  wall * thing is 0.625 +- 0.062 (mean of 2)\n"
                      "  not at the minimum: a Newton step would move wall by -0.5: more than the standard errors\n"),
            std::string::npos)
      << text;
}

TEST_F(Report, SaysThatTheLossHasRisen) {
  const Parameters parameters(scene_, {albedo("wall", {0.5}, {0.7})});
  state_.theta = {0.6875};
  state_.loss_initial = 2;
  state_.loss_noise_initial = 0.3;
  last_.loss_noise = 0.4;
  for (const double loss : {4.4, 4.6}) {
    last_.loss = loss;
    const std::string text = run_report({}, state_, last_, parameters, {});
    EXPECT_EQ(text.find(": it has risen; try shorter steps") != std::string::npos, loss > 4.5) << text;
  }
}

/// Of 100 readings: a deviance of 150 for 98, with and without light.
GoodnessOfFit fit_of(double p, double light, double background) {
  GoodnessOfFit fit;
  fit.fit = {150, 98, 97, 14, p};
  fit.background.p_value = background;
  fit.light_p_value = light;
  return fit;
}

TEST_F(Report, SaysWhetherTheDataAreExplained) {
  const Parameters parameters(scene_, {albedo("wall", {0.5}, {0.7})});
  state_.theta = {0.6875};
  const auto screen = [&](const GoodnessOfFit& fit) { return run_report({}, state_, last_, parameters, {}, fit); };
  EXPECT_NE(
      screen(fit_of(0.25, 0, 0)).find("  fit: explains the data (deviance 150, 98 +- 14 to be expected, p = 0.25)\n"),
      std::string::npos)
      << screen(fit_of(0.25, 0, 0));
  EXPECT_NE(screen(fit_of(1e-4, 0, 0)).find("  fit: does not explain the data ("), std::string::npos);
  EXPECT_EQ(screen(fit_of(1e-4, 0, 0)).find("no Poisson numbers"), std::string::npos);
  EXPECT_NE(screen(fit_of(1, 0, 0)).find("p = 1: no Poisson numbers, or not at rest)\n"), std::string::npos);
  EXPECT_NE(screen(fit_of(1e-4, 0.5, 0)).find("  fit: has lost the light of the data ("), std::string::npos);
  EXPECT_NE(screen(fit_of(0.25, 0.5, 0.5)).find("  fit: no signal, "), std::string::npos);
  const std::string summary = summary_yaml({}, state_, last_, parameters, {}, {}, fit_of(1e-4, 0, 0));
  EXPECT_NE(summary.find("\nfit: {deviance: 150, degrees_of_freedom: 97, floor: 98, p_value: 0.0001, "
                         "verdict: unexplained}\n"),
            std::string::npos)
      << summary;
  EXPECT_EQ(summary_yaml({}, state_, last_, parameters).find("fit:"), std::string::npos);
}

TEST_F(Report, ARunLeftItsDataWhereItsLightIsGoneOrItIsWorseThanItsStart) {
  EXPECT_TRUE(left_its_data(fit_of(1e-4, 0.5, 1e-4), state_, last_));
  EXPECT_TRUE(left_its_data(fit_of(0.5, 0.5, 1e-4), state_, last_));
  EXPECT_EQ(fit_of(0.5, 0.5, 1e-4).verdict(), FitVerdict::unexplained) << "no verdict beside `diverged` says otherwise";
  EXPECT_FALSE(left_its_data(fit_of(1e-4, 0, 0), state_, last_));
  last_.loss = state_.loss_initial + 3.1 * std::hypot(last_.loss_noise, state_.loss_noise_initial);
  EXPECT_TRUE(left_its_data(fit_of(1e-4, 0, 0), state_, last_));
  EXPECT_FALSE(left_its_data(fit_of(0.25, 0, 0), state_, last_));
  EXPECT_FALSE(left_its_data(fit_of(1, 0, 0), state_, last_)) << "too near is no worse than before";
  last_.loss = state_.loss_initial + 2.9 * std::hypot(last_.loss_noise, state_.loss_noise_initial);
  EXPECT_FALSE(left_its_data(fit_of(1e-4, 0, 0), state_, last_));
}

TEST_F(Report, NamesGradientsThatAreExactlyZero) {
  const Parameters parameters(scene_, {albedo("wall", {0.5}, {0.7}), albedo("thing", {0.25}, {})});
  EXPECT_EQ(zero_gradient_report(parameters, {1e-300, 0}),
            "  thing: the gradient is exactly zero: nothing that was rendered depends on it\n");
}

TEST(ReportOfFiles, NamesWhatTheFolderHolds) {
  const TemporaryFolder folder;
  for (const char* name : {"summary.yaml", "log.csv", "final.exr", "residual.png", "experiment.yaml"})
    folder.write(name, "");
  std::filesystem::create_directory(folder.file("geometry"));
  EXPECT_EQ(files_to_look_at(folder.path(), true), "  " + folder.path() +
                                                       "\n    results: summary.yaml, log.csv, final.exr\n"
                                                       "    meshes: geometry/\n    pictures: residual.png\n"
                                                       "    to resume: experiment.yaml\n");
  EXPECT_EQ(files_to_look_at(folder.path(), false).find("png"), std::string::npos);
}

TEST_F(Report, ManyComponentsAreOneRow) {
  scene_.positions = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}};
  scene_.triangles = {{{0, 2, 1}, 0}, {{0, 1, 3}, 0}, {{0, 3, 2}, 0}, {{1, 2, 3}, 0}};
  scene_.shapes = {{.name = "tetra",
                    .file = "",
                    .material = 0,
                    .emission = {},
                    .first_vertex = 0,
                    .vertex_count = 4,
                    .first_triangle = 0,
                    .triangle_count = 4}};
  ParameterSpec dent;
  dent.name = "dent";
  dent.type = ParameterType::vertices;
  dent.shape = "tetra";
  dent.direction = {0, 1, 0};
  dent.initial = {1};
  dent.target = {0};
  const Parameters parameters(scene_, {dent});
  state_.theta = {0.3, -0.3, 0.1, -0.1};
  // The root of (0.09 + 0.09 + 0.01 + 0.01) / 4.
  const std::string text = run_report({}, state_, last_, parameters);
  EXPECT_NE(text.find("  dent (rms of 4)              1        0.22361              0        0.22361              1\n"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace isochron
