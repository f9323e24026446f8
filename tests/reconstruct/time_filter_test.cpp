#include "optim/reconstruct/time_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "optim/reconstruct/voxel_sums.h"
#include "tests/seed.h"

namespace isochron {
namespace {

double hat(double x) {
  return (1 - x * x) * std::exp(-0.5 * x * x);
}

/// One point of the wall, and a count.
Histograms one_count(int bins, double bin, int at) {
  Histograms histograms;
  histograms.bin = bin;
  histograms.bins = bins;
  histograms.rows = {{{0.1, 0.2, 0}, -1, 0.5 * bin}};
  histograms.counts.assign(bins, 0);
  histograms.counts[at] = 1;
  return histograms;
}

TEST(TimeFilter, LightOfOneLengthLeavesTheFilterItself) {
  const TimeFilter filter = time_filter(0.02, {}, 1e-5);
  EXPECT_NEAR(filter.delay, 0, 3e-4);
  // (1 - x^2) exp(-x^2 / 2) = 1/2 at x = 0.62595.
  EXPECT_NEAR(hat(0.62595), 0.5, 1e-4);
  EXPECT_NEAR(filter.width, 2 * 0.62595 * 0.02, 1e-4);
}

TEST(TimeFilter, ResponsesDelay) {
  // A gaussian that comes late: filtered, it is a hat of the squares' sum.
  std::vector<double> offsets, values;
  for (int i = 0; i <= 400; ++i) {
    offsets.push_back(0.03 + 0.0005 * i);
    values.push_back(std::exp(-0.5 * std::pow((offsets.back() - 0.13) / 0.015, 2)));
  }
  const DetectorResponse response(LinearDensity(offsets, values, "response"));
  EXPECT_NEAR(response_deviation(response, 1e-6), 0.015, 1e-4);
  EXPECT_NEAR(response_deviation(response, 0.02), std::hypot(0.015, 0.02 / std::sqrt(12)), 1e-4);
  const TimeFilter filter = time_filter(0.02, response, 1e-5);
  EXPECT_NEAR(filter.delay, 0.13, 3e-4);
  EXPECT_NEAR(filter.width, 2 * 0.62595 * 0.025, 2e-4);
}

/// A peak of 0.015 and 80 m of dark counts, a millionth of it each: with all pieces summed at all times it would take minutes.
TEST(TimeFilter, DarkCountsFarFromAPeakChangeNothing) {
  std::vector<double> offsets, values;
  for (int i = 0; i <= 65536; ++i) {
    offsets.push_back(0.0012 * i);
    values.push_back(1e-6 + std::exp(-0.5 * std::pow((offsets.back() - 20) / 0.015, 2)));
  }
  const DetectorResponse response(LinearDensity(offsets, values, "response"));
  EXPECT_NEAR(response_deviation(response, 1e-6), 0.015, 1e-4);
  const TimeFilter filter = time_filter(0.02, response, 1e-5);
  EXPECT_NEAR(filter.delay, 20, 3e-4);
  EXPECT_NEAR(filter.width, 2 * 0.62595 * 0.025, 2e-4);
}

TEST(FilteredHistograms, SumsAreTheFiltersAtTheDistanceInTime) {
  constexpr double kStep = 0.005, kSigma = 0.03;
  constexpr int kAt = 120;
  const Histograms histograms = one_count(400, kStep, kAt);
  const TimeFilter filter{kSigma, 0.04, 0};
  const FilteredHistograms filtered(histograms, filter);
  SummedVoxels block;
  std::mt19937 random(test_seed(1));
  std::uniform_real_distribution<float> at(0.15f, 0.35f);
  for (int i = 0; i < VoxelBlock::kVoxels; ++i)
    block.across[i] = at(random), block.up[i] = at(random), block.depth[i] = at(random);
  sum_over_histograms(histograms, filtered, filter, block);
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    const Vec3 way{block.across[i] - 0.1, block.up[i] - 0.2, block.depth[i]};
    const double r = length(way), late = 2 * r + 0.04 - (kAt + 0.5) * kStep;
    // Interpolation over a sixth of a standard deviation is off by 3 / (8 x 36) of the maximum at most; beyond four the filter ends.
    EXPECT_NEAR(block.sum[i], hat(late / kSigma), 0.012);
    EXPECT_NEAR(block.variance[i], std::pow(hat(late / kSigma), 2), 0.03);
    EXPECT_NEAR(block.response[i], std::pow(way.z / (r * r * r), 2), 1e-4 * block.response[i]);
  }
}

TEST(FilteredHistograms, WhatDoesNotChangeLeavesNothing) {
  Histograms histograms = one_count(100, 0.01, 0);
  histograms.counts.assign(100, 7);
  const FilteredHistograms filtered(histograms, {0.04, 0, 0});
  EXPECT_EQ(filtered.first(), 8);
  EXPECT_EQ(filtered.steps(), 100 - 2 * 8 - 1);
  for (int k = 0; k < filtered.steps(); ++k) EXPECT_NEAR(filtered.row(0)[k].value, 0, 1e-5);
}

/// Over 400 draws of 64 points at 27 places the mean of the significances would scatter by 0.05, that of their squares by 0.07, if all
/// places had the same noise, and by a fifth of that if each had its own; some three of them are independent. Asked for at 4 standard
/// errors then (false alarms: 1e-4 each).
TEST(FilteredHistograms, SumsOfNoiseHaveTheVarianceThatIsStated) {
  std::mt19937 random(test_seed(2));
  std::poisson_distribution<int> counts(3);
  constexpr int kDraws = 400;
  double mean = 0, square = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Histograms histograms;
    histograms.bin = 0.01;
    histograms.bins = 128;
    for (int i = 0; i < 64; ++i) histograms.rows.push_back({{0.05 * (i % 8), 0.05 * (i / 8), 0}, -1, 0.005});
    for (int i = 0; i < 64 * 128; ++i) histograms.counts.push_back(static_cast<float>(counts(random)));
    const TimeFilter filter{0.02, 0, 0};
    SummedVoxels block;
    block.across.fill(0.2f);
    block.up.fill(0.2f);
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) block.depth[i] = 0.1f + 0.4f * static_cast<float>(i % 27) / 27;
    sum_over_histograms(histograms, FilteredHistograms(histograms, filter), filter, block);
    for (int i = 0; i < 27; ++i) {
      const double z = block.sum[i] / std::sqrt(block.variance[i]);
      mean += z / (27 * kDraws);
      square += z * z / (27 * kDraws);
    }
  }
  EXPECT_NEAR(mean, 0, 0.12);
  EXPECT_NEAR(square, 1, 0.16);
}

}  // namespace
}  // namespace isochron
