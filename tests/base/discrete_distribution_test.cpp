#include "core/base/discrete_distribution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <string>

namespace isochron {
namespace {

struct Case {
  std::string name;
  std::vector<double> weights;
};

std::vector<Case> cases() {
  std::vector<double> growing, rare(1000, 1e-9), gaps(300);
  for (int i = 0; i < 100; ++i) growing.push_back(std::ldexp(1.0, i / 3));
  rare[437] = 1;
  for (int i = 7; i < 250; i += 11) gaps[i] = i % 5 + 1;
  std::vector<double> falling(growing.rbegin(), growing.rend());
  return {{"one", {3}},          {"alike", std::vector<double>(129, 0.1)}, {"growing", growing}, {"falling", falling},
          {"one of many", rare}, {"gaps, and none at the ends", gaps}};
}

// Every index takes the part of (0, 1) that its cumulative sums say, wherever the search starts from.
TEST(DiscreteDistribution, DrawsByCumulativeSums) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const DiscreteDistribution distribution(c.weights);
    std::vector<double> sums(c.weights.size() + 1, 0.0);
    std::partial_sum(c.weights.begin(), c.weights.end(), sums.begin() + 1);
    EXPECT_EQ(distribution.total(), sums.back());
    constexpr int kDraws = 4099;
    for (int k = 0; k < kDraws; ++k) {
      double u = (k + 0.5) / kDraws;
      const double target = u * sums.back();
      const int expected = distribution.prefetch(u), i = distribution.sample(u);
      ASSERT_TRUE(expected >= 0 && expected < static_cast<int>(c.weights.size())) << k;
      if (c.name == "alike") {
        ASSERT_NEAR(expected, i, 1) << k;
      }
      ASSERT_LE(sums[i], target) << k;
      ASSERT_LT(target, sums[i + 1]) << k;
      EXPECT_NEAR(u, (target - sums[i]) / (sums[i + 1] - sums[i]), 1e-12) << k;
      EXPECT_EQ(distribution.below(i), sums[i] / sums.back());
      EXPECT_EQ(distribution.probability(i), (sums[i + 1] - sums[i]) / sums.back());
    }
  }
}

// The numbers nearest to 0 and 1 draw the first and the last index that have a weight.
TEST(DiscreteDistribution, HoldsAtTheEnds) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const DiscreteDistribution distribution(c.weights);
    const auto weighs = [](double w) { return w > 0; };
    double first = 0x1p-60, last = 1 - 0x1p-53;
    EXPECT_EQ(distribution.sample(first), std::ranges::find_if(c.weights, weighs) - c.weights.begin());
    const auto from_behind = std::find_if(c.weights.rbegin(), c.weights.rend(), weighs);
    EXPECT_EQ(distribution.sample(last), static_cast<int>(c.weights.rend() - from_behind) - 1);
    for (double u : {first, last}) EXPECT_TRUE(u > 0 && u < 1) << u;
  }
}

TEST(DiscreteDistribution, IsEmptyWithoutWeight) {
  EXPECT_TRUE(DiscreteDistribution().empty());
  EXPECT_TRUE(DiscreteDistribution(std::vector<double>(3, 0.0)).empty());
  EXPECT_FALSE(DiscreteDistribution({0, 1e-300}).empty());
}

}  // namespace
}  // namespace isochron
