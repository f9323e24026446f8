#include "core/base/sincos_2pi.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/seed.h"

namespace isochron {
namespace {

constexpr long double kTurn = 2 * std::numbers::pi_v<long double>;

TEST(Turn, AgreesWithLongDouble) {
  std::mt19937_64 rng(test_seed(1));
  std::uniform_real_distribution<double> uniform(-2, 2);
  for (int i = 0; i < 100000; ++i) {
    const double u = uniform(rng);
    const SineCosine t = sincos_2pi(u);
    ASSERT_NEAR(t.sine, static_cast<double>(std::sin(kTurn * u)), 3e-16) << "u = " << u;
    ASSERT_NEAR(t.cosine, static_cast<double>(std::cos(kTurn * u)), 3e-16) << "u = " << u;
  }
}

TEST(Turn, IsExactAtQuarters) {
  const double sine[] = {0, 1, 0, -1}, cosine[] = {1, 0, -1, 0};
  for (int q = -8; q <= 8; ++q) {
    const SineCosine t = sincos_2pi(0.25 * q);
    EXPECT_EQ(t.sine, sine[(q + 8) % 4]) << "quarter " << q;
    EXPECT_EQ(t.cosine, cosine[(q + 8) % 4]) << "quarter " << q;
  }
}

TEST(Turn, KeepsRelativeAccuracyNextToZero) {
  for (double u = 1e-3; u > 1e-30; u *= 0.1) {
    const double expected = static_cast<double>(std::sin(kTurn * u));
    EXPECT_NEAR(sincos_2pi(u).sine / expected, 1, 4e-16) << "u = " << u;
    EXPECT_NEAR(sincos_2pi(-u).sine / -expected, 1, 4e-16) << "u = " << u;
  }
}

}  // namespace
}  // namespace isochron
