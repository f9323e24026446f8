// The likelihood of counts: its values, and that noise of the image does not move its stationary point.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "optim/problem/loss.h"
#include "optim/problem/photon_noise.h"
#include "optim/problem/statistics.h"

namespace isochron {
namespace {

ReadingLoss poisson_loss(double scale) {
  return {LossKind::poisson, scale};
}

TEST(Poisson, IsHalfTheDeviance) {
  const ReadingLoss loss = poisson_loss(0.1);
  for (const auto& [mean, count] : {std::pair{3.0, 5.0}, {0.7, 0.0}, {0.2, 1.0}, {40.0, 37.0}}) {
    const double saturated = count > 0 ? count - count * std::log(count) : 0;
    // A count of 0 lies below the scale, where the loss is a parabola: less by scale / 2.
    const double expected = mean - count * std::log(mean) - saturated - (count == 0 ? 0.05 : 0);
    EXPECT_NEAR(loss.value(mean, count), expected, 1e-12) << mean;
  }
  for (double count : {0.0, 0.05, 1.0, 300.0}) EXPECT_EQ(loss.value(count, count), 0) << count;
}

TEST(Poisson, DerivativesAreThoseOfTheValue) {
  const ReadingLoss loss = poisson_loss(0.5);
  for (double mean : {-0.3, 0.0, 0.2, 0.6, 4.0})
    for (double count : {0.0, 0.3, 2.0, 7.0}) {
      const double h = 1e-5;
      const double slope = (loss.value(mean + h, count) - loss.value(mean - h, count)) / (2 * h);
      EXPECT_NEAR(2 * loss.weight(mean, count) * (mean - count), slope, 1e-7) << mean << " " << count;
      const auto slope_at = [&](double m) { return 2 * loss.weight(m, count) * (m - count); };
      EXPECT_NEAR(loss.second(mean, count), (slope_at(mean + h) - slope_at(mean - h)) / (2 * h), 1e-6);
      EXPECT_NEAR(loss.third(mean, count), (loss.second(mean + h, count) - loss.second(mean - h, count)) / (2 * h),
                  1e-4);
    }
  EXPECT_TRUE(std::isfinite(loss.value(0, 1000)));
}

/// Counts of one mean against noisy images of it: each half is `mean` times a gamma-like factor, the mean of `samples`
/// exponential numbers.
struct Noisy {
  GatedImage first, second, target;
};
Noisy draw(double truth, double model, int pixels, int samples, std::uint32_t seed) {
  Noisy result{GatedImage(pixels, 1, 1, 1), GatedImage(pixels, 1, 1, 1), GatedImage(pixels, 1, 1, 1)};
  for (int p = 0; p < pixels; ++p) {
    Rng rng({23, seed, 0}, static_cast<std::uint64_t>(p), 0);
    for (GatedImage* half : {&result.first, &result.second})
      for (int s = 0; s < samples; ++s) half->data[p] -= model * std::log(rng.uniform()) / samples;
    result.target.data[p] = poisson(truth, rng);
  }
  return result;
}

// The slope of the loss at the true mean, which is where it has to vanish: a stationary point moves by slope over curvature.
// 4.5 standard errors: by chance 7e-6 for each of the three means. The naive slopes, of an image that weighs its own
// residual or of weights made of the counts, have to fail the same test.
TEST(Poisson, StationaryPointIsTheTruthHoweverNoisyTheImage) {
  constexpr int kPixels = 2000, kImages = 100, kSamples = 4;
  for (double truth : {0.3, 1.0, 3.0}) {
    const ReadingLoss loss = poisson_loss(0.02 * truth);
    ReplicateStatistics slopes;
    for (std::uint32_t i = 0; i < kImages; ++i) {
      const Noisy noisy = draw(truth, truth, kPixels, kSamples, i);
      const SplitImage image = join_halves(noisy.first, kSamples, noisy.second, kSamples);
      double ours = 0, own = 0, by_counts = 0;
      for (double a : loss_adjoint(image, noisy.target, loss).data) ours += a;
      for (int p = 0; p < kPixels; ++p) {
        const double m = image.image.data[p], n = noisy.target.data[p];
        own += (1 - n / m) / kPixels;
        by_counts += (m - n) / std::max(n, 1.0) / kPixels;
      }
      slopes.add({ours, own, by_counts}, 1);
    }
    const Statistics found = slopes.result();
    EXPECT_LT(std::abs(found.mean[0]), 4.5 * found.standard_error[0]) << truth;
    // Slope over curvature, 1 / truth at least: how far off the stationary point would be; the test is that sharp.
    EXPECT_LT(found.standard_error[0] * truth, 0.01 * truth) << truth;
    EXPECT_GT(std::abs(found.mean[1]), 4.5 * found.standard_error[1]) << truth;
    EXPECT_GT(std::abs(found.mean[2]), 4.5 * found.standard_error[2]) << truth;
  }
}

// Most samples miss: the halves are zero four times out of five. Unequal halves. 4.5 standard errors, 7e-6 by chance.
TEST(Poisson, RareSamplesDoNotPushTowardsDark) {
  constexpr int kPixels = 2000;
  const double truth = 0.5;
  const ReadingLoss loss = poisson_loss(0.02 * truth);
  ReplicateStatistics slopes;
  for (std::uint32_t i = 0; i < 100; ++i) {
    GatedImage halves[] = {GatedImage(kPixels, 1, 1, 1), GatedImage(kPixels, 1, 1, 1)}, target(kPixels, 1, 1, 1);
    for (int p = 0; p < kPixels; ++p) {
      Rng rng({29, i, 0}, static_cast<std::uint64_t>(p), 0);
      for (GatedImage& half : halves) half.data[p] = rng.uniform() < 0.2 ? 5 * truth : 0;
      target.data[p] = poisson(truth, rng);
    }
    double sum = 0;
    for (double a : loss_adjoint(join_halves(halves[0], 2, halves[1], 1), target, loss).data) sum += a;
    slopes.add({sum}, 1);
  }
  const Statistics found = slopes.result();
  EXPECT_LT(std::abs(found.mean[0]), 4.5 * found.standard_error[0]);
}

// Of the value what is left is of second order in the variance, v = truth^2 / 64 here: third derivatives times the skewness,
// 2 n / truth^3 * 2 truth^3 / 64^2 / 6, and a like one of the fourth: below 2e-3. The plain value is off by n v / 2 truth^2,
// 8e-3.
TEST(Poisson, ValueIsCorrectedForNoise) {
  constexpr int kPixels = 2000, kSamples = 32;
  const double truth = 1;
  const ReadingLoss loss = poisson_loss(0.02 * truth);
  ReplicateStatistics values;
  for (std::uint32_t i = 0; i < 60; ++i) {
    const Noisy noisy = draw(truth, truth, kPixels, kSamples, i);
    const SplitImage image = join_halves(noisy.first, kSamples, noisy.second, kSamples);
    double plain = 0, exact = 0;
    for (int p = 0; p < kPixels; ++p) {
      plain += loss.value(image.image.data[p], noisy.target.data[p]) / kPixels;
      exact += loss.value(truth, noisy.target.data[p]) / kPixels;
    }
    values.add({estimate_loss(image, noisy.target, loss).value - exact, plain - exact}, 1);
  }
  const Statistics found = values.result();
  EXPECT_LT(std::abs(found.mean[0]), 1e-3 + 4.5 * found.standard_error[0]);
  EXPECT_GT(found.mean[1], 4e-3 + 4.5 * found.standard_error[1]);
}

TEST(Poisson, SlopeNeedsTwoHalves) {
  const GatedImage image(1, 1, 1, 1);
  EXPECT_THROW(loss_adjoint(SplitImage{image, {}, 1}, image, poisson_loss(1)), std::logic_error);
}

}  // namespace
}  // namespace isochron
