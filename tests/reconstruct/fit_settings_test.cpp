// How fine the meshes of a reconstruction become. Closed forms, no random numbers.
#include "optim/reconstruct/fit_settings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "optim/reconstruct/back_projection.h"
#include "tests/reconstruct/simulated.h"

namespace isochron {
namespace {

constexpr double kBinOfWall = 0.01;

BackProjection wall_projected(const CaptureGeometry& wall) {
  return back_project(expected_counts(wall, {{{0, 0, 0.4}, {0, 0, -1}, 1}}, 256, kBinOfWall, 100));
}

/// For a square of that area.
FitSettings settings_for(double area, double resolution, int histograms = 4096, double seconds = 300) {
  const double side = std::sqrt(area);
  return fit_settings({{{0, 0, 0}, {side, 0, 0}, {side, side, 0}, {0, side, 0}}, {{0, 1, 2}, {0, 2, 3}}}, resolution,
                      {histograms, true, seconds});
}

TEST(FitSettings, NeitherTheLayoutNorThePointsLimitTheResolution) {
  CaptureGeometry lit_once = square_wall(32, 0.5);
  add_spots(lit_once, {{0, 0, 0}});
  const BackProjection dense = wall_projected(square_wall(32, 0.5)), sparse = wall_projected(square_wall(12, 0.5)),
                       one_spot = wall_projected(lit_once);
  EXPECT_DOUBLE_EQ(dense.finest_resolution, dense.lateral_resolution);
  EXPECT_NEAR(one_spot.lateral_resolution, 2 * dense.lateral_resolution, 0.1 * dense.lateral_resolution);
  EXPECT_NEAR(one_spot.finest_resolution, dense.finest_resolution, 0.05 * dense.finest_resolution);
  EXPECT_GT(sparse.lateral_resolution, 1.5 * dense.lateral_resolution);
  EXPECT_NEAR(sparse.finest_resolution, dense.finest_resolution, 0.05 * dense.finest_resolution);
}

TEST(FitSettings, EdgesOfAResolutionAndOneLevelWithHalfOfThat) {
  const FitSettings small = settings_for(0.04, 0.0137);
  EXPECT_DOUBLE_EQ(small.edge_length, 0.0137);
  EXPECT_EQ(small.levels, small.coarse_levels + 1);
  EXPECT_EQ(small.more_levels, 1);
}

/// 500 triangles' pairs of 4.8 cm make a square metre.
TEST(FitSettings, LargeSurfacesBeginCoarser) {
  const FitSettings small = settings_for(0.04, 0.0137), large = settings_for(1, 0.0137);
  EXPECT_NEAR(large.edge_length, 0.048, 0.0005);
  EXPECT_EQ(large.levels, small.levels);
  EXPECT_EQ(large.samples, small.samples);
}

/// A level takes as long whether light comes back the way it went or not, which is two rays for a sample.
TEST(FitSettings, SamplesOfTwoWaysAreFewer) {
  const Mesh start{{{0, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0}}, {{0, 1, 2}}};
  const FitSettings one = fit_settings(start, 0.0137, {4096, true, 300}),
                    two = fit_settings(start, 0.0137, {4096, false, 300});
  EXPECT_NEAR(1.35 * two.samples, one.samples, 2);
  EXPECT_NEAR(two.coarse_histograms, one.coarse_histograms, 10);
}

/// 1206 of 4096 with 398 samples each; more where each has fewer, so that an image of them has as many for the same time.
TEST(FitSettings, CoarseLevelsHaveSamplesEnough) {
  const FitSettings usual = settings_for(0.04, 0.0137);
  EXPECT_EQ(usual.samples, 398);
  EXPECT_EQ(usual.coarse_histograms, 1206);
  const FitSettings many =
      fit_settings({{{0, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0}}, {{0, 1, 2}}}, 0.0137, {.histograms = 1 << 16});
  EXPECT_LT(many.samples, 64);
  EXPECT_NEAR(many.coarse_histograms * many.samples, 480000, 64);
  const FitSettings quick = settings_for(0.04, 0.0137, 4096, 60), small = settings_for(0.04, 0.0137, 576, 60);
  EXPECT_NEAR(quick.coarse_histograms, 1206, 28) << "a fifth of the work by a fifth of the samples";
  const FitSettings tiny = settings_for(0.04, 0.0137, 64, 60);
  EXPECT_NEAR(small.coarse_histograms, 256, 1) << "the least, as samples are even";
  EXPECT_NEAR(small.coarse_histograms * small.samples, quick.coarse_histograms * quick.samples, 600);
  EXPECT_NEAR(64 * tiny.samples, quick.coarse_histograms * quick.samples, 600) << "all that there are";
}

/// 400 points: three bins before the detector is on, some that are dark, and light that differs from point to point.
CaptureFile lit_after(int dark_bins, double spread) {
  std::mt19937 random(7);
  CaptureFile capture;
  capture.geometry = square_wall(20, 0.5);
  capture.counts = GatedImage(20, 20, 64, 1);
  for (int p = 0; p < 400; ++p) {
    const double background = 2 * (1 + spread * std::sin(1.7 * p)), light = p % 3;
    for (int g = 3; g < 64; ++g)
      capture.counts.at(p, g) =
          std::poisson_distribution<int>(g < 3 + dark_bins ? background : background + light)(random);
  }
  return capture;
}

TEST(FitSettings, BackgroundsDifferWhereWhatComesBeforeLightDoes) {
  EXPECT_FALSE(backgrounds_differ(lit_after(20, 0), {})) << "light differs, not they";
  EXPECT_TRUE(backgrounds_differ(lit_after(20, 0.3), {}));
  EXPECT_TRUE(backgrounds_differ(lit_after(6, 0.5), {})) << "few dark bins";
  CaptureFile one = lit_after(20, 0);
  for (int g = 0; g < 64; ++g) one.counts.at(33, g) *= 8;
  EXPECT_TRUE(backgrounds_differ(one, {}));
  std::vector<std::uint8_t> used(400, 1);
  used[33] = 0;
  EXPECT_FALSE(backgrounds_differ(one, used));
  CaptureFile none = lit_after(20, 0);
  for (int p = 0; p < 400; ++p)
    for (int g = 0; g < 64; ++g) none.counts.at(p, g) = g < 30 ? 0 : std::max(0, g - 30 - p % 7);
  EXPECT_FALSE(backgrounds_differ(none, {})) << "nothing but light";
}

}  // namespace
}  // namespace isochron
