// The comparison of derivatives with finite differences: its numbers, and that it sees a wrong derivative.
#include "optim/analysis/check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "optim/problem/heavy_tail.h"
#include "optim/problem/student.h"
#include "tests/optim/tiny_scene.h"

namespace isochron {
namespace {

TEST(Check, LimitIsStudentsQuantile) {
  // Two-sided quantiles of published tables, to the digits given there.
  EXPECT_NEAR(false_alarm_limit(1, 1), 63.657, 5e-4);
  EXPECT_NEAR(false_alarm_limit(1, 2), 9.925, 5e-4);
  EXPECT_NEAR(false_alarm_limit(1, 3), 5.841, 5e-4);
  EXPECT_NEAR(false_alarm_limit(1, 30), 2.750, 5e-4);
  EXPECT_NEAR(false_alarm_limit(10, 30), 3.646, 5e-4);
  EXPECT_NEAR(false_alarm_limit(5, 31, 0.25), 2.040, 5e-4);
  EXPECT_NEAR(false_alarm_limit(1, 30.9), 2.750, 5e-4);  // degrees are rounded down
  EXPECT_NEAR(false_alarm_limit(1, INFINITY), 2.576, 6e-3);
  EXPECT_NEAR(student_quantile_95(7.5), 2.365, 5e-4);
  EXPECT_NEAR(student_quantile_95(7.5), 2.365, 5e-4) << "from the table";
  EXPECT_NEAR(student_quantile_95(1), 12.706, 5e-4);
}

TEST(Check, ExtrapolationIsExactForSixthDegree) {
  const auto f = [](double x) { return 3 + x * (0.7 + x * (1 + x * (-2 + x * (5 + x * (4 + x * 6))))); };
  const auto central = [&](double h) { return (f(h) - f(-h)) / (2 * h); };
  EXPECT_NEAR(extrapolate(central(0.5), central(0.25), central(0.125)), 0.7, 1e-14);
}

class CheckTiny : public testing::Test {
 protected:
  CheckTiny() {
    write_tiny_scene(folder_);
    file_ = folder_.write("tiny.yaml", tiny_experiment());
  }
  TemporaryFolder folder_;
  std::string file_;
};

TEST_F(CheckTiny, SeesAFactorOfTwoAndAMissingTerm) {
  std::vector<std::string> notes;
  const Problem problem(check_experiment(
      load_experiment(file_, {"samples={primal: 65536, interior: 16, visibility: 0, path_length: 0}"}), notes));
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_NE(notes[0].find("visibility"), std::string::npos);
  EXPECT_EQ(problem.experiment().samples.interior, 65536);
  EXPECT_EQ(problem.experiment().samples.path_length, 0);  // a gaussian has no jumps
  std::vector<Comparison> table;
  for (int component : {0, 1})
    for (const Comparison& row : check_derivative(problem, problem.parameters().initial(), component))
      table.push_back(row);
  ASSERT_EQ(table.size(), 4u);
  for (const Comparison& row : table) EXPECT_FALSE(disagrees(row, 4));  // false alarm: 1 %, seed fixed
  EXPECT_NE(table[0].terms[1], 0);
  for (const Comparison& row : table) {
    EXPECT_NEAR(row.total, row.terms[0] + row.terms[1] + row.terms[2], 1e-12 * std::abs(row.total));
    const auto differs = [&](double total) {
      Comparison wrong = row;
      wrong.z = z_score(total, row.standard_error, row.finite_difference, row.finite_difference_error);
      return disagrees(wrong, 4);
    };
    EXPECT_TRUE(differs(2 * row.total)) << row.parameter << " gate " << row.gate;
    EXPECT_TRUE(differs(-row.total)) << row.parameter << " gate " << row.gate;
    if (row.parameter == "height") {
      EXPECT_TRUE(differs(row.terms[0])) << "visibility left out";
    }
    EXPECT_FALSE(differs(row.total));
  }
}

TEST_F(CheckTiny, NumbersWithoutErrorOrValue) {
  EXPECT_EQ(z_score(0, 0, 0, 0), 0);
  EXPECT_EQ(z_score(3, 3, -2, 4), 1);
  Comparison row;
  row.z = z_score(1, 0, 2, 0);
  EXPECT_TRUE(disagrees(row, 4));
  row.z = std::nan("");
  EXPECT_TRUE(disagrees(row, 4));
}

/// An error from one degree of freedom says little: of 10 rows, |z| = 50 is nothing.
TEST_F(CheckTiny, EveryRowIsJudgedByItsDegreesOfFreedom) {
  Comparison row;
  row.z = 50;
  row.degrees = 1.9;
  EXPECT_FALSE(disagrees(row, 10));
  row.degrees = 30;
  EXPECT_TRUE(disagrees(row, 10));
}

/// Gates that few paths meet do not pass for sure; one that all paths meet does. Its count: 256 pixels of one material, whose noises
/// are about alike, make 46 with a scatter of 15 % (over 20 seeds); 4 is 17 of these below in the logarithm. That of the least
/// of the narrow gates is 1 to 1.9: one hit or a few.
TEST_F(CheckTiny, RareHitsAreFlagged) {
  const std::string scene =
      replaced(folder_.read("scene.yaml"), "block.obj, material: metal", "block.obj, material: white");
  const auto smallest_count = [&](const char* resolution, const char* gates) {
    folder_.write("scene.yaml", replaced(scene, "[8, 8]", resolution));
    std::vector<std::string> notes;
    const Problem problem(check_experiment(
        load_experiment(file_, {std::string("gates=") + gates,
                                "parameters[0]=", "samples={primal: 64, interior: 64, visibility: 0, path_length: 0}"}),
        notes));
    double least = INFINITY;
    for (const Comparison& row : check_derivative(problem, problem.parameters().initial(), 0))
      least = std::min(least, row.effective_count);
    return least;
  };
  const double few = smallest_count("[8, 8]", "{kind: boxcar, centers: {start: 3, stop: 8, count: 40}, width: 0.02}");
  const double many = smallest_count("[16, 16]", "{kind: boxcar, centers: [5.5], width: 5}");
  RecordProperty("few", std::to_string(few));
  RecordProperty("many", std::to_string(many));
  EXPECT_LT(few, kFewestDeviations);
  EXPECT_GT(many, kFewestDeviations);
}

TEST_F(CheckTiny, ADifferenceThatSawNothingIsNoVerdict) {
  Comparison row;
  EXPECT_EQ(finding(row, 4), Finding::nothing);
  row.total = 2;
  row.standard_error = 0.1;
  row.rounding = 1e-15;
  const auto of = [&](double difference, double error) {
    row.finite_difference = difference;
    row.finite_difference_error = error;
    row.z = z_score(row.total, row.standard_error, difference, error);
    return finding(row, 4);
  };
  EXPECT_EQ(of(0, 0), Finding::difference_saw_nothing);
  EXPECT_EQ(of(-2e-15, 1e-15), Finding::difference_saw_nothing) << "as is rounding";
  EXPECT_EQ(of(1e-9, 1e-9), Finding::differs);
  EXPECT_EQ(of(0, 1e-3), Finding::differs);
  EXPECT_EQ(of(2.1, 0), Finding::agrees);
  row.standard_error = 2;
  EXPECT_EQ(of(0, 0), Finding::agrees) << "the derivative is not told from zero either";
}

/// A step so small that no path changes sides of a shadow edge: of the last gates, where only shadows change, nothing is seen.
TEST_F(CheckTiny, ATinyStepMissesShadowEdges) {
  std::vector<std::string> notes;
  const Problem problem(check_experiment(load_experiment(file_, {"gates={kind: boxcar, centers: [4.5, 6], width: 0.5}",
                                                                 "gradient={step: 1e-6}", "samples.primal=64"}),
                                         notes));
  const auto rows = check_derivative(problem, problem.parameters().initial(), 0);
  EXPECT_GT(rows[1].rounding, 0);
  EXPECT_EQ(finding(rows[0], 2), Finding::differs);
  EXPECT_EQ(finding(rows[1], 2), Finding::difference_saw_nothing);
}

TEST_F(CheckTiny, TermsAndStepsFollowTheExperiment) {
  std::vector<std::string> notes;
  const Problem boxcar(
      check_experiment(load_experiment(file_, {"gates={kind: boxcar, centers: [4.5], width: 0.6}"}), notes));
  EXPECT_EQ(boxcar.experiment().samples.path_length, 16);
  EXPECT_EQ(notes.size(), 1u);
  const std::vector<double> theta = boxcar.parameters().initial();
  // The scene's box is 4 x 2 x 4: its diagonal is 6.
  EXPECT_NEAR(check_step(boxcar, theta, 0), 0.06, 1e-12);
  EXPECT_NEAR(check_step(boxcar, theta, 1), 0.05 * 8, 1e-12);
  const Problem given(check_experiment(load_experiment(file_, {"gradient={step: 0.02}"}), notes));
  EXPECT_EQ(check_step(given, theta, 0), 0.02);
  EXPECT_EQ(check_step(given, theta, 1), 0.02);
  const Problem narrow(
      check_experiment(load_experiment(file_, {"gates.sigma=0.01", "parameters[0].direction=[0, 2, 0]"}), notes));
  EXPECT_NEAR(check_step(narrow, theta, 0), 0.0025, 1e-12);
  EXPECT_THROW(check_experiment(load_experiment(file_, {"samples={primal: 1, interior: 1, visibility: 1, "
                                                        "path_length: 1}"}),
                                notes),
               std::runtime_error);
}

}  // namespace
}  // namespace isochron
