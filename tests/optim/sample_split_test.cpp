// The split of samples against brute force, and the variance components against a simulated table.
#include "optim/analysis/sample_split.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/seed.h"

namespace isochron {
namespace {

constexpr std::array<bool, 3> kAll{true, true, true};
const GradientVariance kVariance{2.0, {5.0, 0.3, 0.01}, {7.0, 0.1, 0.2}};
const PerPass kCost{1.0, 3.0, 0.5, 2.0};

double time_of(const PerPass& n) {
  double sum = 0;
  for (int i = 0; i < kPasses; ++i) sum += kCost[i] * n[i];
  return sum;
}

TEST(SampleSplit, WithoutCrossTermsIsInProportionToRootVarianceOverCost) {
  GradientVariance v = kVariance;
  v.cross = {};
  const PerPass n = best_split(v, kCost, kAll, 40);
  EXPECT_NEAR(time_of(n), 40, 1e-6);
  const double unit = n[0] / std::sqrt(v.image / kCost[0]);
  for (int t = 0; t < 3; ++t) EXPECT_NEAR(n[1 + t], unit * std::sqrt(v.term[t] / kCost[1 + t]), 1e-5 * n[1 + t]);
}

TEST(SampleSplit, BeatsEverySplitOnAGrid) {
  for (const double time : {2.0, 40.0, 1000.0}) {
    const PerPass best = best_split(kVariance, kCost, kAll, time);
    EXPECT_NEAR(time_of(best), time, 1e-6 * time);
    double least = std::numeric_limits<double>::infinity();
    constexpr int kSteps = 60;
    for (int i = 1; i < kSteps; ++i)
      for (int j = 1; i + j < kSteps; ++j)
        for (int k = 1; i + j + k < kSteps; ++k) {
          const double share = time / kSteps;
          least = std::min(least, kVariance({share * i / kCost[0], share * j / kCost[1], share * k / kCost[2],
                                             share * (kSteps - i - j - k) / kCost[3]}));
        }
    EXPECT_LE(kVariance(best), least);
    EXPECT_GT(kVariance(best), 0.95 * least);  // the grid is fine enough to come near
  }
}

TEST(SampleSplit, ImagesKeepTwoHalves) {
  const GradientVariance all_of_the_terms{0, {1, 1, 1}, {}};  // the image makes no noise
  EXPECT_EQ(cheapest_split(all_of_the_terms, kCost, kAll, 0.5)[0], 2);
}

TEST(SampleSplit, WholeNumbersAreTheCheapestOfAll) {
  for (const double wanted : {8.0, 2.0, 0.7}) {
    const std::array<int, kPasses> n = cheapest_split(kVariance, kCost, kAll, wanted);
    const PerPass chosen{1.0 * n[0], 1.0 * n[1], 1.0 * n[2], 1.0 * n[3]};
    EXPECT_LE(kVariance(chosen), wanted);
    double least = std::numeric_limits<double>::infinity();
    for (double a = 1; a < 20; ++a)
      for (double b = 1; b < 20; ++b)
        for (double c = 1; c < 20; ++c)
          for (double d = 1; d < 6; ++d)
            if (kVariance({a, b, c, d}) <= wanted) least = std::min(least, time_of({a, b, c, d}));
    EXPECT_LE(time_of(chosen), 1.02 * least) << wanted;  // single steps may end beside the best
  }
}

TEST(SampleSplit, TermsThatAreNotKeptGetNone) {
  const std::array<int, kPasses> n = cheapest_split(kVariance, kCost, {true, false, false}, 0.5);
  EXPECT_EQ(n[2], 0);
  EXPECT_EQ(n[3], 0);
  EXPECT_GT(n[1], 1);
  // A term without variance still needs its one sample.
  EXPECT_EQ(cheapest_split({1, {1, 0, 0}, {}}, kCost, kAll, 0.5)[2], 1);
}

TEST(SampleSplit, ComponentsOfASimulatedTable) {
  // Each component's estimate over 3000 tables within 4 of its standard errors: false alarm 3 x 6e-5, seed
  // fixed.
  std::mt19937 random(test_seed(7));
  std::normal_distribution<double> normal;
  const double rows = 2, columns = 0.5, cells = 3;
  double sum[3] = {0, 0, 0}, squares[3] = {0, 0, 0};
  constexpr int kTables = 3000;
  for (int k = 0; k < kTables; ++k) {
    std::vector<std::vector<double>> table(6, std::vector<double>(9));
    std::vector<double> b(9);
    for (double& x : b) x = std::sqrt(columns) * normal(random);
    for (auto& row : table) {
      const double a = 5 + std::sqrt(rows) * normal(random);
      for (int j = 0; j < 9; ++j) row[j] = a + b[j] + std::sqrt(cells) * normal(random);
    }
    const VarianceComponents v = variance_components(table);
    const double value[3] = {v.rows, v.columns, v.cells};
    for (int i = 0; i < 3; ++i) {
      sum[i] += value[i];
      squares[i] += value[i] * value[i];
    }
  }
  const double truth[3] = {rows, columns, cells};
  for (int i = 0; i < 3; ++i) {
    const double mean = sum[i] / kTables;
    const double error = std::sqrt((squares[i] / kTables - mean * mean) / (kTables - 1));
    EXPECT_LT(std::abs(mean - truth[i]), 4 * error) << i;
    EXPECT_LT(error, 0.1 * truth[i]) << i;
  }
}

}  // namespace
}  // namespace isochron
