// Likely albedos of two plates with a gap, a point and voxels that the counts were made of. Counts are expected ones but where stated.
#include "optim/reconstruct/likely_albedos.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "tests/reconstruct/simulated.h"

namespace isochron {
namespace {

constexpr double kLikelyBin = 0.01;
constexpr int kLikelyBins = 128;

LinearDensity late(double width, double first = 0) {
  return {{first, first + 0.5 * width, first + 2 * width}, {0, 1, 0}, "response"};
}

struct Found {
  BackProjection volume;
  LikelyAlbedos likely;
  explicit Found(const CaptureFile& capture, const DetectorResponse& response = {})
      : volume(back_project(capture, response)),
        likely(likely_albedos(volume, histograms(capture, volume.frame), response)) {}
};

/// Sums of albedos over the lines within `half` of a place.
template <class Volume>
double albedo_about(const Volume& volume, double x, double y, double half) {
  double sum = 0;
  for (std::size_t i = 0; i < volume.albedo.size(); ++i) {
    const double a = volume.across[i % volume.across.size()],
                 u = volume.up[i / volume.across.size() % volume.up.size()];
    if (std::abs(a - x) < half && std::abs(u - y) < half) sum += std::max(0.0f, volume.albedo[i]);
  }
  return sum;
}

CaptureFile two_plates(const CaptureGeometry& wall, const DetectorResponse& response = {}) {
  std::vector<HiddenPatch> patches = plate({-0.045, 0, 0.4}, 0.05, 0.12, 0.01);
  const std::vector<HiddenPatch> other = plate({0.045, 0, 0.4}, 0.05, 0.12, 0.01);
  patches.insert(patches.end(), other.begin(), other.end());
  CaptureFile capture = expected_counts(wall, patches, kLikelyBins, kLikelyBin, 5000, response);
  for (double& value : capture.counts.data) value += 0.5;
  return capture;
}

/// 4 cm between plates of 5 cm, where back-projection's resolution is 2 cm.
void expect_gap(const CaptureFile& capture, const DetectorResponse& response = {}) {
  const Found found(capture, response);
  ASSERT_FALSE(found.likely.albedo.empty());
  const auto in_gap = [](const auto& volume) {
    return albedo_about(volume, 0, 0, 0.01) /
           (0.5 * (albedo_about(volume, -0.045, 0, 0.01) + albedo_about(volume, 0.045, 0, 0.01)));
  };
  EXPECT_LT(in_gap(found.likely), 0.1);
  EXPECT_GT(in_gap(found.volume), 2.5 * in_gap(found.likely));
  EXPECT_NEAR(albedo_about(found.likely, -0.045, 0, 0.02), albedo_about(found.likely, 0.045, 0, 0.02),
              0.1 * albedo_about(found.likely, 0.045, 0, 0.02));
}

TEST(LikelyAlbedos, AreLowInAGapOfConfocalScans) {
  expect_gap(two_plates(square_wall(20, 0.5)));
}

TEST(LikelyAlbedos, AreLowInAGapOfOthersWithAResponse) {
  CaptureGeometry wall = square_wall(16, 0.6);
  add_spots(wall, {{0.1, 0.1, 0}, {-0.2, 0.1, 0}, {0, -0.3, 0}, {0.2, -0.1, 0}});
  expect_gap(two_plates(wall, late(0.02)), late(0.02));
}

/// A plate and a dim one beside sixty times as much background: what is left out as dark is dark beside what is found, not beside what all
/// began with.
TEST(LikelyAlbedos, DimPlatesAreFoundBesideMuchBackground) {
  std::vector<HiddenPatch> patches = plate({-0.045, 0, 0.4}, 0.05, 0.12, 0.01);
  for (HiddenPatch patch : plate({0.045, 0, 0.4}, 0.05, 0.12, 0.01)) {
    patch.area *= 0.4;
    patches.push_back(patch);
  }
  CaptureFile capture = expected_counts(square_wall(20, 0.5), patches, kLikelyBins, kLikelyBin, 5000);
  for (double& value : capture.counts.data) value += 60 * 5000.0 / kLikelyBins;
  const Found found(capture);
  EXPECT_NEAR(albedo_about(found.likely, 0.045, 0, 0.03) / albedo_about(found.likely, -0.045, 0, 0.03), 0.4, 0.1);
}

/// The depth is the patch's, whatever the response and the ways to the wall.
TEST(LikelyAlbedos, APatchIsWhereItIs) {
  CaptureGeometry wall = square_wall(16, 0.5);
  wall.accounts_first_and_last = true;
  wall.laser_origin = {0.3, 0, 0.2};
  wall.sensor_origin = {-0.2, 0.1, 0.2};
  const Vec3 hidden{0.04, -0.03, 0.38};
  const LinearDensity response = late(0.03, -0.045);
  CaptureFile capture = expected_counts(wall, {{hidden, {0, 0, -1}, 1}}, 160, kLikelyBin, 2000, response);
  for (double& value : capture.counts.data) value += 0.2;
  const LikelyAlbedos found = Found(capture, response).likely;
  Vec3 mean;
  double sum = 0;
  for (std::size_t i = 0; i < found.albedo.size(); ++i) {
    const std::size_t across = found.across.size(), up = found.up.size();
    mean += Vec3{found.across[i % across], found.up[i / across % up], found.depth[i / across / up]} * found.albedo[i];
    sum += found.albedo[i];
  }
  mean = mean / sum;
  EXPECT_NEAR(mean.x, hidden.x, 0.1 * found.resolution);
  EXPECT_NEAR(mean.y, hidden.y, 0.1 * found.resolution);
  EXPECT_NEAR(mean.z, hidden.z, 0.25 * kLikelyBin);
}

/// What the voxels send to all points, by the closed form, is the counts' light without their background.
TEST(LikelyAlbedos, SendTheLightThatIsCounted) {
  const CaptureGeometry wall = square_wall(16, 0.5);
  for (const double background : {0.1, 10.0}) {
    CaptureFile capture = two_plates(wall);
    for (double& value : capture.counts.data) value += background - 0.5;
    const LikelyAlbedos found = Found(capture).likely;
    const std::size_t across = found.across.size(), up = found.up.size();
    double sent = 0;
    for (std::size_t i = 0; i < found.albedo.size(); ++i) {
      const Vec3 voxel{found.across[i % across], found.up[i / across % up], found.depth[i / across / up]};
      for (const Vec3& point : wall.sensor)
        sent += found.albedo[i] * voxel.z * voxel.z / std::pow(length(voxel - found.frame.to_wall(point)), 6);
    }
    EXPECT_NEAR(sent / (5000 * static_cast<double>(wall.sensor.size())), 1, 0.01) << background;
  }
}

TEST(LikelyAlbedos, AreNoneBelowZeroAndNoneFarFromWhatIsSignificant) {
  std::mt19937 random(test_seed(3));
  const Found found(counted(two_plates(square_wall(16, 0.5)), 0.2, random));
  const std::size_t across = found.likely.across.size(), up = found.likely.up.size();
  ASSERT_EQ(across, 2 * found.volume.across.size());
  EXPECT_NEAR(0.5 * (found.likely.across[0] + found.likely.across[1]), found.volume.across[0], 1e-12);
  std::size_t lit = 0;
  for (std::size_t i = 0; i < found.likely.albedo.size(); ++i) {
    ASSERT_GE(found.likely.albedo[i], 0);
    if (found.likely.albedo[i] == 0) continue;
    ++lit;
    const int a = static_cast<int>(i % across / 2), u = static_cast<int>(i / across % up / 2),
              d = static_cast<int>(i / across / up / 2);
    bool near = false;
    for (int e = d - 2; e <= d + 2; ++e)
      for (int v = u - 2; v <= u + 2; ++v)
        for (int b = a - 2; b <= a + 2; ++b)
          near = near ||
                 (b >= 0 && v >= 0 && e >= 0 && b < static_cast<int>(found.volume.across.size()) &&
                  v < static_cast<int>(found.volume.up.size()) && e < static_cast<int>(found.volume.depth.size()) &&
                  found.volume.is_surface(found.volume.index(e, v, b)));
    ASSERT_TRUE(near);
  }
  EXPECT_GT(lit, 100u);
}

TEST(LikelyAlbedos, ThreadsDoNotMatter) {
  std::mt19937 random(test_seed(4));
  const CaptureFile capture = counted(two_plates(square_wall(12, 0.5)), 0.2, random);
  const std::vector<float> all = Found(capture).likely.albedo;
  set_thread_count(1);
  const std::vector<float> one = Found(capture).likely.albedo;
  set_thread_count(0);
  EXPECT_EQ(all, one);
}

TEST(LikelyAlbedos, NothingWhereNothingIsSignificant) {
  std::mt19937 random(test_seed(5));
  CaptureFile capture = two_plates(square_wall(12, 0.5));
  std::fill(capture.counts.data.begin(), capture.counts.data.end(), 0.0);
  EXPECT_TRUE(Found(counted(capture, 1, random)).likely.albedo.empty());
}

}  // namespace
}  // namespace isochron
