// What the standard errors of losses say about a run.
#include "optim/solvers/descent.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/optim/synthetic_objective.h"

namespace isochron {
namespace {

struct Seen {
  int warnings = 0;
  DescentState state;
  bool settled = false;
};

/// 100 iterations of `loss(i)` plus normal noise of standard deviation `noise`; theta is the iteration.
Seen watch(std::uint64_t seed, double noise, const std::function<double(int)>& loss) {
  Descent descent(100);
  Seen seen;
  for (int i = 0; i <= 100; ++i) {
    Rng rng({seed, static_cast<std::uint32_t>(i), 0}, 0, 0);
    seen.warnings += !descent.observe(i, {1.0 * i}, loss(i) + noise * ExponentialFit::normal(rng), noise).empty();
  }
  seen.state = descent.state();
  seen.settled = descent.settled();
  if (seen.settled) {
    EXPECT_NEAR(descent.settled_theta()[0], 63, 1e-12);  // rows 26 to 100
  }
  return seen;
}

TEST(Descent, WarnsOnceWhereNoiseHidesIt) {
  int flat = 0, falling = 0;
  constexpr int kRuns = 1000;
  for (std::uint64_t seed = 1; seed <= kRuns; ++seed) {
    const int warnings = watch(seed, 1, [](int) { return 0; }).warnings;
    EXPECT_LE(warnings, 1);
    flat += warnings;
    // Between its first two blocks of 10 rows it falls by 4 standard errors, sqrt(2 / 10) each.
    falling += watch(seed, 1, [](int i) { return i < 10 ? 4 * std::sqrt(0.2) : 0; }).warnings;
  }
  // Stated: 0.95 and 0.023; standard deviations of the counts 7 and 4.7.
  EXPECT_NEAR(flat, 954, 35);
  EXPECT_LT(falling, 23 + 5 * 4.7);
  // Without noise nothing hides it, and a descent that is over after one row is seen, too.
  EXPECT_EQ(watch(1, 0, [](int) { return 1; }).warnings, 0);
  EXPECT_EQ(watch(1, 0.01, [](int i) { return i == 0 ? 1 : 0; }).warnings, 0);
}

TEST(Descent, AverageForgetsAShorterSchedule) {
  Descent shorter(100);
  for (int i = 0; i <= 100; ++i) shorter.observe(i, {1.0 * i}, 0, 1);
  Descent longer(200, shorter.state());
  for (int i = 101; i <= 200; ++i) {
    EXPECT_FALSE(longer.settled()) << i;
    longer.observe(i, {1.0 * i}, 0, 1);
  }
  ASSERT_TRUE(longer.settled());
  EXPECT_NEAR(longer.settled_theta()[0], 150.5, 1e-12);  // rows 101 to 200
}

TEST(Descent, SettlesUnlessTheLossStillFalls) {
  int flat = 0, falling = 0;
  for (std::uint64_t seed = 1; seed <= 1000; ++seed) {
    flat += watch(seed, 1, [](int) { return 0; }).settled;
    // By 8 standard errors, sqrt(1 / 37 + 1 / 38), from half to half of the last 75 rows.
    falling += watch(seed, 1, [](int i) { return i < 63 ? 8 * 0.231 : 0; }).settled;
  }
  EXPECT_GE(flat, 990);  // 0.0013 are taken to fall
  EXPECT_EQ(falling, 0);
  EXPECT_FALSE(watch(1, 0, [](int i) { return std::exp2(-i); }).settled);
}

TEST(Descent, TellsNoiseFromChange) {
  double share = 0;
  for (std::uint64_t seed = 1; seed <= 50; ++seed)
    share += loss_spread(watch(seed, 1, [](int i) { return 3 * std::sin(i); }).state).noise_share / 50;
  EXPECT_NEAR(share, 1 / 5.5, 0.05);  // of a variance of 1 + 9 / 2
  EXPECT_EQ(loss_spread({}).rows, 0);
  EXPECT_TRUE(std::isnan(loss_spread({}).noise_share));
}

}  // namespace
}  // namespace isochron
