// How fine the meshes of a reconstruction become. Closed forms, no random numbers.
#include "optim/reconstruct/fit_settings.h"

#include <gtest/gtest.h>

#include <cmath>

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
                      histograms, seconds);
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
  const FitSettings large = settings_for(1, 0.0137);
  EXPECT_NEAR(large.edge_length, 0.048, 0.0005);
  EXPECT_EQ(large.levels, large.coarse_levels + 2) << "2.4 and 1.2 cm; 0.6 would make 32000 vertices";
  EXPECT_EQ(large.more_levels, 0);
  EXPECT_EQ(settings_for(1, 0.03).levels, large.coarse_levels + 2) << "2.4 and 1.2 cm, which is no finer than half";
  EXPECT_EQ(settings_for(0.5, 0.0137).levels, large.coarse_levels + 2) << "1.7 and 0.8 cm";
}

TEST(FitSettings, TheWorkOfALevelFallsWithTheirNumber) {
  const FitSettings small = settings_for(0.04, 0.0137), large = settings_for(1, 0.0137);
  ASSERT_LT(small.levels, large.levels);
  EXPECT_NEAR(large.samples * large.levels, small.samples * small.levels, 2 * large.levels);
}

/// 1206 of 4096 with 398 samples each; more where each has fewer, so that an image of them has as many for the same time.
TEST(FitSettings, CoarseLevelsHaveSamplesEnough) {
  const FitSettings usual = settings_for(0.04, 0.0137);
  EXPECT_EQ(usual.samples, 398);
  EXPECT_EQ(usual.coarse_histograms, 1206);
  const FitSettings many = fit_settings({{{0, 0, 0}, {0.2, 0, 0}, {0, 0.2, 0}}, {{0, 1, 2}}}, 0.0137, 1 << 16, 300);
  EXPECT_LT(many.samples, 64);
  EXPECT_NEAR(many.coarse_histograms * many.samples, 480000, 64);
  const FitSettings quick = settings_for(0.04, 0.0137, 4096, 60), small = settings_for(0.04, 0.0137, 576, 60);
  EXPECT_NEAR(quick.coarse_histograms, 1206, 28) << "a fifth of the work by a fifth of the samples";
  const FitSettings tiny = settings_for(0.04, 0.0137, 64, 60);
  EXPECT_NEAR(small.coarse_histograms, 256, 1) << "the least, as samples are even";
  EXPECT_NEAR(small.coarse_histograms * small.samples, quick.coarse_histograms * quick.samples, 600);
  EXPECT_NEAR(64 * tiny.samples, quick.coarse_histograms * quick.samples, 600) << "all that there are";
}

}  // namespace
}  // namespace isochron
