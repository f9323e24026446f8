#include "core/base/fast_angle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/base/random.h"

namespace isochron {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

TEST(FastAngle, AsTheLibraryInLongDouble) {
  double worst = 0;
  for (std::uint32_t k = 0; k < 1000000; ++k) {
    Rng rng(Stream{3, 0, 0}, 0, k);
    const double y = (2 * rng.uniform() - 1) * std::exp2(k % 3 ? 0 : 120 * (rng.uniform() - 0.5));
    const double x = 2 * rng.uniform() - 1;
    const long double expected = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    const double allowed = std::max(kEpsilon * static_cast<double>(std::abs(expected)), 1e-16);
    worst = std::max(worst, static_cast<double>(std::abs(fast_angle(y, x) - expected)) / allowed);
  }
  EXPECT_LT(worst, 2);
  std::printf("off by %.2f units in the last place at most\n", worst);
}

TEST(FastAngle, KnowsTheAxesAndTheZeroVector) {
  EXPECT_EQ(fast_angle(0, 2), 0);
  EXPECT_EQ(fast_angle(0, -2), kPi);
  EXPECT_EQ(fast_angle(-0.0, -2), -kPi);
  EXPECT_EQ(fast_angle(3, 0), kPi / 2);
  EXPECT_EQ(fast_angle(-3, 0), -kPi / 2);
  EXPECT_EQ(fast_angle(1, 1), kPi / 4);
  EXPECT_EQ(fast_angle(0, 0), 0);
  EXPECT_EQ(fast_angle(1e-320, 1), 1e-320);
}

TEST(FastAngle, CosineAndSine) {
  double worst = 0;
  for (int k = -100000; k <= 100000; ++k) {
    const double angle = k * 0.001 + 1e-7 * (k % 10);
    const CosSin of = fast_cos_sin(angle);
    const long double exact = angle;
    worst = std::max({worst, static_cast<double>(std::abs(of.cosine - std::cos(exact))),
                      static_cast<double>(std::abs(of.sine - std::sin(exact)))});
  }
  EXPECT_LT(worst, 3e-16);
  EXPECT_EQ(fast_cos_sin(0).cosine, 1);
  EXPECT_EQ(fast_cos_sin(0).sine, 0);
}

}  // namespace
}  // namespace isochron
