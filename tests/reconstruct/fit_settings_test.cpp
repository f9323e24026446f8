// How fine the meshes of a reconstruction become. Closed forms, no random numbers.
#include "optim/reconstruct/fit_settings.h"

#include <gtest/gtest.h>

#include "optim/reconstruct/back_projection.h"
#include "tests/reconstruct/simulated.h"

namespace isochron {
namespace {

constexpr double kBinOfWall = 0.01;

BackProjection wall_projected(const CaptureGeometry& wall) {
  return back_project(expected_counts(wall, {{{0, 0, 0.4}, {0, 0, -1}, 1}}, 256, kBinOfWall, 100));
}

FitSettings settings_for(const BackProjection& volume, int vertices) {
  Mesh start;
  start.positions.resize(vertices);
  return fit_settings(start, volume.lateral_resolution, volume.finest_resolution, 4096, 300);
}

struct Volumes {
  BackProjection dense = wall_projected(square_wall(32, 0.5)), sparse = wall_projected(square_wall(12, 0.5)),
                 one_spot = wall_projected(lit_once(square_wall(32, 0.5)));
  static CaptureGeometry lit_once(CaptureGeometry wall) {
    add_spots(wall, {{0, 0, 0}});
    return wall;
  }
};

const Volumes& volumes() {
  static const Volumes all;
  return all;
}

TEST(FitSettings, OneFinerLevelWherePointsAreDense) {
  const BackProjection& dense = volumes().dense;
  EXPECT_DOUBLE_EQ(dense.finest_resolution, dense.lateral_resolution);
  EXPECT_EQ(settings_for(dense, 300).levels, settings_for(dense, 300).coarse_levels + 1);
}

TEST(FitSettings, MoreWhereLayoutOrPointsLimitBackProjectionAlone) {
  const auto& [dense, sparse, one_spot] = volumes();
  EXPECT_NEAR(one_spot.lateral_resolution, 2 * dense.lateral_resolution, 0.1 * dense.lateral_resolution);
  EXPECT_NEAR(one_spot.finest_resolution, dense.finest_resolution, 0.05 * dense.finest_resolution);
  EXPECT_NEAR(sparse.finest_resolution, dense.finest_resolution, 0.05 * dense.finest_resolution);
  EXPECT_EQ(settings_for(one_spot, 300).levels, settings_for(dense, 300).levels + 1);
  EXPECT_GT(settings_for(sparse, 300).levels, settings_for(dense, 300).levels);
}

TEST(FitSettings, NoLevelOfTooManyVertices) {
  const FitSettings many = settings_for(volumes().dense, 6000);
  EXPECT_EQ(many.levels, many.coarse_levels);
}

TEST(FitSettings, TheWorkOfALevelFallsWithTheirNumber) {
  const FitSettings dense = settings_for(volumes().dense, 300), one_spot = settings_for(volumes().one_spot, 300);
  EXPECT_NEAR(one_spot.samples * one_spot.levels, dense.samples * dense.levels, 2 * one_spot.levels);
}

}  // namespace
}  // namespace isochron
