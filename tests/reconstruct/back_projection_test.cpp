#include "optim/reconstruct/back_projection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "optim/problem/memory.h"
#include "optim/reconstruct/significance.h"
#include "tests/reconstruct/simulated.h"

namespace isochron {
namespace {

constexpr double kBin = 0.01;
constexpr int kBins = 140;
const Vec3 kHidden{0.07, -0.05, 0.42};

/// Where the albedo is largest, in the capture's coordinates.
Vec3 brightest(const BackProjection& found) {
  const auto top = std::max_element(found.albedo.begin(), found.albedo.end()) - found.albedo.begin();
  const std::size_t a = top % found.across.size(), u = top / found.across.size() % found.up.size(),
                    d = top / (found.across.size() * found.up.size());
  return found.frame.to_capture({found.across[a], found.up[u], found.depth[d]});
}

/// The maximum is at the hidden patch, to a voxel and half of a bin, and what is found lies within two lateral resolutions from
/// it, but for specks.
void expect_found(const CaptureFile& capture, const DetectorResponse& response = {},
                  const std::vector<std::uint8_t>& used = {}) {
  const BackProjection found = back_project(capture, response, used);
  ASSERT_FALSE(found.depth.empty());
  const Vec3 truth = found.frame.to_wall(kHidden), top = found.frame.to_wall(brightest(found));
  EXPECT_NEAR(top.x, truth.x, 0.5 * found.lateral_resolution);
  EXPECT_NEAR(top.y, truth.y, 0.5 * found.lateral_resolution);
  EXPECT_NEAR(top.z, truth.z, 0.5 * found.depth_resolution + 0.25 * kBin);
  double near = 0, all = 0;
  for (std::size_t i = 0; i < found.albedo.size(); ++i) {
    if (!found.is_surface(i)) continue;
    const double dx = found.across[i % found.across.size()] - truth.x;
    const double dy = found.up[i / found.across.size() % found.up.size()] - truth.y;
    all += found.albedo[i];
    if (std::hypot(dx, dy) < 2 * found.lateral_resolution) near += found.albedo[i];
  }
  EXPECT_GT(near, 0.97 * all);
}

CaptureFile of_patch(const CaptureGeometry& wall, const DetectorResponse& response = {}, int bins = kBins) {
  std::mt19937 random(test_seed(5));
  return counted(expected_counts(wall, {{kHidden, {0, 0, -1}, 1}}, bins, kBin, 100, response), 0.2, random);
}

TEST(BackProjection, FindsAPatchFromConfocalPoints) {
  expect_found(of_patch(square_wall(16, 0.5)));
}

TEST(BackProjection, FindsItFromPointsInNoOrder) {
  CaptureGeometry wall = square_wall(16, 0.5);
  std::mt19937 random(test_seed(6));
  std::uniform_real_distribution<double> at(-0.25, 0.25);
  wall.columns = 256;
  wall.rows = 1;
  for (Vec3& point : wall.sensor) point = {at(random), at(random), 0};
  expect_found(of_patch(wall));
}

TEST(BackProjection, FindsItFromOneSpotAndFromMany) {
  CaptureGeometry wall = square_wall(20, 0.8);
  add_spots(wall, {{0.1, 0.1, 0}});
  expect_found(of_patch(wall));
  add_spots(wall, {{0.1, 0.1, 0}, {-0.2, 0.1, 0}, {0, -0.3, 0}});
  expect_found(of_patch(wall));
}

/// One point that looks while the laser scans sees what as many points see of one spot.
TEST(BackProjection, FindsItFromOnePointAndAScanningLaser) {
  CaptureGeometry wall = square_wall(20, 0.8);
  const std::vector<Vec3> scanned = wall.sensor;
  wall.columns = wall.rows = 1;
  wall.sensor = {{0.1, 0.1, 0}};
  wall.sensor_normal = {{0, 0, 1}};
  add_spots(wall, scanned);
  expect_found(of_patch(wall));
}

TEST(BackProjection, TakesTheWaysToTheWallAway) {
  CaptureGeometry wall = square_wall(16, 0.5);
  wall.accounts_first_and_last = true;
  wall.laser_origin = {0.3, 0, 1};
  wall.sensor_origin = {-0.2, 0.1, 0.8};
  expect_found(of_patch(wall, {}, 350));
}

TEST(BackProjection, TakesTheResponsesDelayAway) {
  const DetectorResponse response(LinearDensity({0, 0.1, 0.12, 0.16}, {0, 0, 1, 0}, "response"));
  expect_found(of_patch(square_wall(16, 0.5), response), response);
}

TEST(BackProjection, LeavesDeadPointsOut) {
  CaptureFile capture = of_patch(square_wall(16, 0.5));
  std::vector<std::uint8_t> used(256, 1);
  for (int point = 3; point < 256; point += 10) {
    used[point] = 0;
    for (int i = 0; i < kBins; ++i) capture.counts.at(point, i) = i == 40 ? 1e4 : 0;
  }
  capture.counts.at(8, 3) = std::numeric_limits<double>::quiet_NaN();
  expect_found(capture, {}, used);
}

TEST(BackProjection, AWallMayStandAnyhow) {
  CaptureFile capture = of_patch(square_wall(16, 0.5));
  const auto turned = [](const Vec3& p) { return Vec3{p.z + 1, p.x - 2, p.y + 0.5}; };
  for (Vec3& p : capture.geometry.sensor) p = turned(p);
  capture.geometry.sensor_normal.assign(256, {1, 0, 0});
  const BackProjection found = back_project(capture);
  EXPECT_LT(length(brightest(found) - turned(kHidden)), found.lateral_resolution);
  EXPECT_NEAR(dot(cross(found.frame.across, found.frame.up), found.frame.normal), 1, 1e-12);
  EXPECT_LT(length(found.frame.to_capture(found.frame.to_wall({1, 2, 3})) - Vec3{1, 2, 3}), 1e-12);
}

TEST(BackProjection, ThreadsDoNotMatter) {
  const CaptureFile capture = of_patch(square_wall(12, 0.5));
  set_thread_count(1);
  const BackProjection one = back_project(capture);
  set_thread_count(3);
  const BackProjection three = back_project(capture);
  set_thread_count(0);
  ASSERT_FALSE(one.albedo.empty());
  EXPECT_EQ(one.albedo, three.albedo);
  EXPECT_EQ(one.significance, three.significance);
  EXPECT_EQ(one.least_albedo, three.least_albedo);
}

/// Twice 100 volumes of background alone, in each of which something is found with a probability of 0.05 at most. In more than 15
/// of 100 something would be found by chance with 4e-5.
TEST(BackProjection, BackgroundAloneIsFoundAsRarelyAsStated) {
  std::mt19937 random(test_seed(8));
  for (const double background : {0.05, 2.0}) {
    int alarms = 0;
    for (int draw = 0; draw < 100; ++draw) {
      CaptureFile capture;
      capture.geometry = square_wall(8, 0.5);
      capture.delta_t = 0.02;
      capture.counts = GatedImage(8, 8, 64, 1);
      capture = counted(std::move(capture), background, random);
      alarms += !back_project(capture, {}, {}, {.false_alarms = 0.05}).depth.empty();
    }
    EXPECT_LE(alarms, 15) << background;
  }
}

TEST(BackProjection, RefusesWhatCannotBeUsed) {
  const CaptureFile capture = of_patch(square_wall(4, 0.5));
  EXPECT_THROW(back_project(capture, {}, {1, 1}), InputError);
  EXPECT_THROW(back_project(capture, {}, std::vector<std::uint8_t>(16, 0)), InputError);
  EXPECT_THROW(back_project(capture, {}, {}, {.false_alarms = 0}), InputError);
  EXPECT_THROW(back_project(of_patch(square_wall(4, 0.5), {}, 6)), InputError);
  EXPECT_THROW(back_project(of_patch(square_wall(3, 4))), InputError)
      << "neighbours' times differ by more than there are bins";
  CaptureFile early = capture;
  early.t_start = -10;
  EXPECT_THROW(back_project(early), InputError);
}

/// Points in kilometres, or times in nanoseconds: all points see the light of a place at once.
TEST(BackProjection, RefusesUnitsThatAreOffByAThousand) {
  const CaptureFile capture = of_patch(square_wall(4, 0.5));
  EXPECT_NO_THROW(back_project(capture));
  CaptureFile kilometres = capture, nanoseconds = capture;
  for (Vec3& p : kilometres.geometry.sensor) p = p * 1e-3;
  nanoseconds.delta_t *= 1e3;
  for (const CaptureFile* file : {&kilometres, &nanoseconds}) try {
      back_project(*file);
      ADD_FAILURE();
    } catch (const InputError& error) {
      EXPECT_NE(std::string(error.what()).find("(allowed: points in metres, delta_t and t_start as path lengths"),
                std::string::npos)
          << error.what();
    }
}

/// What does not fit is refused in one line before it is made.
TEST(BackProjection, MemoryIsAskedForBeforehand) {
  EXPECT_NO_THROW(require_memory({"a box needs", 3e9}, "leave points out", 3e9));
  try {
    require_memory({"a box needs", 3e9}, "leave points out", 2e9);
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_STREQ(error.what(), "a box needs 3 GB of memory; 2 GB are available: leave points out");
  }
}

TEST(Significance, QuantilesOfTheNormalDistribution) {
  EXPECT_NEAR(normal_quantile_above(0.158655), 1, 1e-5);
  EXPECT_NEAR(normal_quantile_above(9.865876e-10), 6, 1e-6);
}

TEST(Significance, ThresholdsWhereRightOnesLessWrongOnesAreMost) {
  // From the largest on: +1 +1 +1 -2 +1 +1 -2: three more right than wrong at 7 first; the later ones do not make more.
  EXPECT_EQ(surface_threshold({5, 9, 8, 7, -6, 4, -3}), 7);
  EXPECT_EQ(surface_threshold({5, 9, 8, 7, -6, 4, 3.5, -3}), 3.5);
  EXPECT_EQ(surface_threshold({-1, -2}), 0);
  EXPECT_EQ(surface_threshold({}), 0);
}

}  // namespace
}  // namespace isochron
