// Standard errors of unknowns: against the closed form of a straight line through points with known noise.
#include "optim/problem/standard_errors.h"

#include <gtest/gtest.h>

#include <cmath>

namespace isochron {
namespace {

/// Least squares of a + b x through N points at x = 0 ... N - 1 with noise s. The loss is the mean of squares, so that its
/// Gauss-Newton matrix is 2 / N times J'J, and the scale 2 s^2 / N.
constexpr int kPoints = 20;
constexpr double kNoise = 0.3;

std::vector<double> matrix() {
  double one = 0, x = 0, square = 0;
  for (int i = 0; i < kPoints; ++i) one += 1, x += i, square += 1.0 * i * i;
  const double f = 2.0 / kPoints;
  return {f * one, f * x, f * x, f * square};
}

constexpr double kScale = 2 * kNoise * kNoise / kPoints;

TEST(StandardErrors, AreThoseOfALeastSquaresLine) {
  const std::vector<double> errors = standard_errors(matrix(), kScale);
  ASSERT_EQ(errors.size(), 2u);
  const double n = kPoints, mean = (n - 1) / 2, spread = n * (n * n - 1) / 12;
  EXPECT_NEAR(errors[0], kNoise * std::sqrt(1 / n + mean * mean / spread), 1e-12);
  EXPECT_NEAR(errors[1], kNoise / std::sqrt(spread), 1e-12);
}

TEST(StandardErrors, OfTheDiagonalAreLess) {
  const std::vector<double> h = matrix(), both = standard_errors(h, kScale),
                            least = least_standard_errors({h[0], h[3], 0}, kScale);
  EXPECT_NEAR(least[0], kNoise / std::sqrt(kPoints), 1e-12);
  EXPECT_LT(least[0], both[0]);
  EXPECT_LT(least[1], both[1]);
  EXPECT_TRUE(std::isinf(least[2]));  // nothing depends on it
}

TEST(StandardErrors, AreUnknownForNoisyMatricesAndUnknownScales) {
  EXPECT_TRUE(standard_errors({1, 2, 2, 1}, kScale).empty());  // not positive definite
  EXPECT_TRUE(standard_errors({0, 0, 0, 1}, kScale).empty());
  EXPECT_TRUE(standard_errors({}, kScale).empty());
  EXPECT_TRUE(standard_errors(matrix(), std::nan("")).empty());
  EXPECT_TRUE(least_standard_errors({1, 2}, std::nan("")).empty());
}

}  // namespace
}  // namespace isochron
