// The loss of noisy images: unbiased, and with a standard error that holds.
#include "optim/problem/loss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "optim/problem/estimates.h"
#include "optim/problem/statistics.h"
#include "tests/optim/synthetic_objective.h"

namespace isochron {
namespace {

/// Images of one pixel row with two gates whose residuals are `residual`, and normal noise of standard deviation
/// `noise` in the mean of `first` + `second` samples; both gates of a pixel have the same noise.
SplitImage noisy(int pixels, double residual, double noise, int first, int second, std::uint32_t seed) {
  GatedImage halves[] = {GatedImage(pixels, 1, 2, 1), GatedImage(pixels, 1, 2, 1)};
  const int samples[] = {first, second};
  for (std::uint32_t h : {0u, 1u})
    for (int p = 0; p < pixels; ++p) {
      Rng rng({11, seed, h}, static_cast<std::uint32_t>(p), 0);
      const double error = noise * std::sqrt((first + second) / static_cast<double>(samples[h]));
      halves[h].at(p, 0) = halves[h].at(p, 1) = residual + error * ExponentialFit::normal(rng);
    }
  return join_halves(halves[0], first, halves[1], second);
}

TEST(Loss, AdjointIsItsDerivative) {
  SplitImage image{GatedImage(2, 1, 2, 3), GatedImage(2, 1, 2, 3), 0.5};
  GatedImage target(2, 1, 2, 3);
  for (std::size_t i = 0; i < target.data.size(); ++i) {
    image.image.data[i] = std::sin(1.0 + static_cast<double>(i));
    image.difference.data[i] = 0.3 * std::cos(5.0 * static_cast<double>(i));
    target.data[i] = std::cos(2.0 * static_cast<double>(i));
  }
  for (const ReadingLoss& rho :
       {ReadingLoss{}, ReadingLoss{LossKind::huber, 0.5}, ReadingLoss{LossKind::cauchy, 0.5}}) {
    const GatedImage adjoint = loss_adjoint(image, target, rho);
    for (std::size_t i = 0; i < target.data.size(); ++i) {
      SplitImage up = image, down = image;
      up.image.data[i] += 1e-4, down.image.data[i] -= 1e-4;
      const double slope = (estimate_loss(up, target, rho).value - estimate_loss(down, target, rho).value) / 2e-4;
      EXPECT_NEAR(adjoint.data[i], slope, 1e-7);  // entries of up to 0.3
    }
  }
}

TEST(Loss, IsTheProductOfTheResidualsOfTwoHalves) {
  GatedImage first(1, 1, 1, 1), second = first, target = first;
  first.data = {3}, second.data = {-1}, target.data = {1};
  const SplitImage image = join_halves(first, 3, second, 2);
  EXPECT_NEAR(image.image.data[0], (3 * 3.0 - 2 * 1) / 5, 1e-15);
  EXPECT_NEAR(estimate_loss(image, target).value, (3.0 - 1) * (-1 - 1), 1e-14);  // below 0
  EXPECT_NEAR(estimate_loss(image, target).mean_squared_error, -4, 1e-14);
  EXPECT_EQ(root_mean_square_error(-4), 0);
  EXPECT_EQ(root_mean_square_error(4), 2);
  EXPECT_TRUE(std::isnan(root_mean_square_error(std::numeric_limits<double>::quiet_NaN())));
}

TEST(Loss, WithoutNoiseIsRho) {
  GatedImage image(2, 2, 1, 1), target(2, 2, 1, 1);
  for (double& value : image.data) value = 0.5;
  const auto value = [&](const ReadingLoss& rho) {
    return estimate_loss(join_halves(image, 2, image, 2), target, rho).value;
  };
  EXPECT_NEAR(value({}), 0.25, 1e-15);
  EXPECT_NEAR(value({LossKind::huber, 0.2}), 0.2 * (2 * 0.5 - 0.2), 1e-15);
  EXPECT_NEAR(value({LossKind::cauchy, 0.2}), 0.04 * std::log(1 + 0.25 / 0.04), 1e-15);
  EXPECT_TRUE(std::isnan(estimate_loss({image, {}, 1}, target).value));  // a single sample has no halves
  image.data[3] = std::numeric_limits<double>::infinity();
  EXPECT_TRUE(std::isnan(value({})));
}

// 5 standard errors, 6e-7 by chance in each of 12 comparisons.
TEST(Loss, HasNoBiasFromNoise) {
  constexpr int kPixels = 400, kImages = 400;
  constexpr double kNoise = 0.3, kVariance = kNoise * kNoise;
  const GatedImage target(kPixels, 1, 2, 1);
  for (const auto& [first, second] : {std::pair{4, 4}, {2, 1}})
    for (double residual : {0.0, 0.8})
      for (const ReadingLoss& rho :
           {ReadingLoss{}, ReadingLoss{LossKind::huber, 1}, ReadingLoss{LossKind::cauchy, 2}}) {
        ReplicateStatistics statistics;
        double squared_noise = 0, plain = 0;
        for (std::uint32_t i = 0; i < kImages; ++i) {
          const SplitImage image = noisy(kPixels, residual, kNoise, first, second, i);
          const LossEstimate loss = estimate_loss(image, target, rho);
          statistics.add({loss.value}, 1);
          squared_noise += loss.noise * loss.noise / kImages;
          for (double value : image.image.data) plain += rho.value(value) / (2.0 * kPixels * kImages);
        }
        const Statistics found = statistics.result();
        const double error = found.standard_error[0], truth = rho.value(residual);
        // As stated in loss.h, for normal noise.
        const double bias = rho.kind == LossKind::squared ? 0
                            : rho.kind == LossKind::huber ? 0.1 * kVariance
                                                          : 1.5 * kVariance * kVariance / (rho.scale * rho.scale);
        EXPECT_LT(std::abs(found.mean[0] - truth), bias + 5 * error) << residual;
        EXPECT_GT(plain - truth, 10 * error + bias) << residual;  // what the halves are for
        // The standard error of one image against the spread of 400, whose own error is 4 %.
        EXPECT_NEAR(std::sqrt(squared_noise) / (error * std::sqrt(kImages)), 1, 0.2) << residual;
      }
}

}  // namespace
}  // namespace isochron
