// The decisions about bounces and terms, on gradients with given means and errors.
#include "optim/analysis/reduction.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace isochron {
namespace {

/// Two columns; the gradient grows by `increments[limit][term]` along (0.6, 0.8) with every bounce. Noise of
/// standard deviation `noise` sits on the increments, alternating so that means are exact for an even number
/// of replicates.
GradientReplicates make(const std::vector<std::array<double, 3>>& increments, double noise = 0, int replicates = 16) {
  GradientReplicates result(static_cast<int>(increments.size()) - 1, 2);
  for (int r = 0; r < replicates; ++r) {
    std::vector<double> values(increments.size() * 6, 0.0);
    for (std::size_t limit = 0; limit < increments.size(); ++limit)
      for (int t = 0; t < 3; ++t)
        for (int c = 0; c < 2; ++c) {
          const double before = limit ? values[GradientReplicates::index(limit - 1, t, c, 2)] : 0;
          const double n = increments[limit][t] != 0 ? noise * (r % 2 ? 1 : -1) : 0;
          values[GradientReplicates::index(limit, t, c, 2)] = before + (c ? 0.8 : 0.6) * (increments[limit][t] + n);
        }
    result.add(values);
  }
  return result;
}

TEST(Reduction, BiasAndErrorOfKnownGradients) {
  // Full gradient 1, of which the second bounce brings 0.1; noise of both increments is the same, so that the
  // difference has it once and the whole twice.
  const double noise = 0.01;
  const GradientReplicates g = make({{0, 0, 0}, {0.9, 0, 0}, {0.1, 0, 0}}, noise, 16);
  const double error = noise * std::sqrt(16.0 / 15) / 4;
  const RelativeBias bias = relative_bias(g, {1, {true, true, true}});
  EXPECT_NEAR(bias.value, 0.1, 1e-12);
  EXPECT_NEAR(bias.standard_error, error, 1e-12);
  EXPECT_NEAR(bias.upper, (0.1 + 2 * error) / (1 - 4 * error), 1e-12);
  EXPECT_NEAR(bias.lower, (0.1 - 2 * error) / (1 + 4 * error), 1e-12);
}

TEST(Reduction, WhatIsZeroIsZeroWhateverTheNoise) {
  // Not even the gradient is known, but the second bounce and the second term never bring anything.
  const GradientReplicates g = make({{0, 0, 0}, {0.1, 0, 0}, {0, 0, 0}}, 10);
  EXPECT_EQ(relative_bias(g, {1, {true, true, true}}).upper, 0);
  EXPECT_EQ(relative_bias(g, {2, {true, false, false}}).upper, 0);
  EXPECT_EQ(relative_bias(g, {0, {true, true, true}}).upper, std::numeric_limits<double>::infinity());
  const ReductionChoice choice = choose_reduction(std::span(&g, 1), 0.01);
  EXPECT_EQ(choice.kept.max_bounces, 1);
  EXPECT_EQ(choice.kept.terms, (std::array<bool, 3>{true, false, false}));
  EXPECT_EQ(choice.undecided.size(), 1u);  // zero bounces
}

TEST(Reduction, NothingFoundSaysNothing) {
  const GradientReplicates g = make({{0, 0, 0}, {0, 0, 0}});
  EXPECT_EQ(relative_bias(g, {0, {true, true, true}}).upper, std::numeric_limits<double>::infinity());
  const ReductionChoice choice = choose_reduction(std::span(&g, 1), 0.01);
  EXPECT_EQ(choice.kept.max_bounces, 1);
  EXPECT_EQ(choice.kept.terms, (std::array<bool, 3>{true, true, true}));
}

TEST(Reduction, StopsWhereTheBiasIsTooLargeAtAnyPoint) {
  const GradientReplicates far = make({{0, 0, 0}, {1, 0.5, 0}, {0.006, 0, 0}, {0.003, 0, 0}});
  const GradientReplicates near = make({{0, 0, 0}, {1, 0.5, 0}, {0.02, 0, 0}, {0.003, 0, 0}});
  EXPECT_EQ(choose_reduction(std::span(&far, 1), 0.01).kept.max_bounces, 1);
  const std::vector<GradientReplicates> both{far, near};
  const ReductionChoice choice = choose_reduction(both, 0.01);
  EXPECT_EQ(choice.kept.max_bounces, 2);
  EXPECT_EQ(choice.kept.terms, (std::array<bool, 3>{true, true, false}));
  EXPECT_TRUE(choice.undecided.empty());
  ASSERT_EQ(choice.bias.size(), 2u);
  EXPECT_NEAR(choice.bias[0].value, 0.003 / 1.509, 1e-12);
  EXPECT_NEAR(choice.bias[1].value, 0.003 / 1.523, 1e-12);
}

TEST(Reduction, BouncesAndTermsShareTheTolerance) {
  // Either may go alone, but not both; one that outweighs the other would leave no bias in their sum.
  const GradientReplicates g = make({{0, 0, 0}, {1, 0.006, 0}, {0.006, 0, 0}});
  const ReductionChoice choice = choose_reduction(std::span(&g, 1), 0.01);
  EXPECT_EQ(choice.kept.max_bounces, 1);
  EXPECT_EQ(choice.kept.terms, (std::array<bool, 3>{true, true, false}));
}

TEST(Reduction, ADipOnTheWayDoesNotHide) {
  // Two bounces are 5 % off, one is not, by accident: the way to one leads over two.
  const GradientReplicates g = make({{0, 0, 0}, {1, 0, 0}, {0.05, 0, 0}, {-0.05, 0, 0}});
  EXPECT_EQ(choose_reduction(std::span(&g, 1), 0.01).kept.max_bounces, 3);
}

TEST(Reduction, ExpectsBouncesBeyondToShrinkOn) {
  // 1 + 1/4 + 1/16 of a series whose rest is 1/48.
  const GradientReplicates g = make({{0, 0, 0}, {1, 0, 0}, {0.25, 0, 0}, {0.0625, 0, 0}});
  EXPECT_NEAR(expected_beyond(g), 1.0 / 48 / 1.3125, 1e-12);
  EXPECT_EQ(expected_beyond(make({{0, 0, 0}, {1, 0, 0}, {0, 0, 0}})), 0);
  EXPECT_EQ(expected_beyond(make({{0, 0, 0}, {1, 0, 0}})), 0);
  EXPECT_EQ(expected_beyond(make({{0, 0, 0}, {0.5, 0, 0}, {0.5, 0, 0}})), std::numeric_limits<double>::infinity());
}

TEST(Reduction, KeepsWhatNoiseLeavesOpen) {
  // A third bounce of 0.5 %: with errors of 0.1 % it may go, with 0.5 % nobody knows, and a bounce of 5 %
  // stays by right.
  const auto with = [](double bounce, double error) {
    const GradientReplicates g = make({{0, 0, 0}, {1, 0, 0}, {bounce, 0, 0}}, error * std::sqrt(15.0));
    return choose_reduction(std::span(&g, 1), 0.01);
  };
  EXPECT_EQ(with(0.005, 0.001).kept.max_bounces, 1);
  const ReductionChoice open = with(0.005, 0.005);
  EXPECT_EQ(open.kept.max_bounces, 2);
  ASSERT_EQ(open.undecided.size(), 1u);
  EXPECT_NE(open.undecided[0].find("1 bounces"), std::string::npos);
  const ReductionChoice needed = with(0.05, 0.005);
  EXPECT_EQ(needed.kept.max_bounces, 2);
  EXPECT_TRUE(needed.undecided.empty());
}

}  // namespace
}  // namespace isochron
