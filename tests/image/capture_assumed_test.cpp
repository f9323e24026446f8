// What captures lack and what is taken in its place.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/image/wall_plane.h"
#include "tests/image/capture_support.h"
#include "tests/seed.h"

namespace isochron {
namespace {

class CaptureAssumed : public CaptureTest {
 protected:
  /// A grid of points in a plane through `corner` with the axes `across` and `down`, rounded to 32 bits as files may be.
  void write_on_wall(CaptureFile capture, const Vec3& corner, const Vec3& across, const Vec3& down) {
    CaptureGeometry& g = capture.geometry;
    for (int i = 0; i < static_cast<int>(g.sensor.size()); ++i) {
      const Vec3 p = corner + across * (i % g.columns) + down * (i / g.columns);
      g.sensor[i] = {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
    }
    write_capture(path(), capture);
  }
  void empty(const char* name) { replace(name, {0}, {}); }
};

void expect_close(const Vec3& a, const Vec3& b) {
  EXPECT_LT(length(a - b), 1e-6) << a.x << ", " << a.y << ", " << a.z;
}

TEST_F(CaptureAssumed, NoStartIsZero) {
  for (const bool removed : {true, false}) {
    write_capture(path(), any_capture(3, 2, 0, 4));
    removed ? remove("t_start") : empty("t_start");
    const CaptureFile capture = read_capture(path());
    EXPECT_EQ(capture.t_start, 0);
    EXPECT_EQ(capture.assumed,
              std::vector<std::string>{"t_start is missing: taken as 0, so that the first bin begins there"});
  }
}

TEST_F(CaptureAssumed, NoNormalsAreThoseOfThePlane) {
  const Vec3 across{0.3, 0, 0.1}, down{0.02, -0.4, 0.03}, normal = normalize(cross(down, across));
  ASSERT_GT(normal.z, 0.9);
  CaptureFile capture = any_capture(4, 3, 0, 4);
  for (const bool removed : {true, false}) {
    write_on_wall(capture, {1, 2, 3}, across, down);
    removed ? remove("sensor_grid_normals") : empty("sensor_grid_normals");
    const CaptureGeometry g = read_capture_geometry(path());
    for (const Vec3& n : g.sensor_normal) expect_close(n, normal);
    ASSERT_EQ(g.assumed.size(), 1u);
    EXPECT_TRUE(
        g.assumed[0].starts_with("sensor_grid_normals is missing: the wall is taken as the plane of its points"))
        << g.assumed[0];
  }
}

TEST_F(CaptureAssumed, NormalsPointToTheInstrument) {
  const Vec3 across{0.3, 0, 0.1}, down{0.02, -0.4, 0.03}, normal = normalize(cross(down, across));
  for (const double side : {1.0, -1.0}) {
    CaptureFile capture = any_capture(4, 3, 0, 4);
    capture.geometry.accounts_first_and_last = true;
    capture.geometry.laser_origin = capture.geometry.sensor_origin = Vec3{1, 2, 3} + normal * (2 * side);
    write_on_wall(capture, {1, 2, 3}, across, down);
    remove("sensor_grid_normals");
    expect_close(read_capture_geometry(path()).sensor_normal[5], normal * side);
  }
}

TEST_F(CaptureAssumed, OneSpotHasTheWallOfTheSensor) {
  CaptureFile capture = any_capture(4, 3, 1, 4);
  write_on_wall(capture, {1, 2, 3}, {0.3, 0, 0.1}, {0.02, -0.4, 0.03});
  remove("laser_grid_normals");
  const CaptureGeometry g = read_capture_geometry(path());
  expect_close(g.laser_normal[0], g.sensor_normal[0]);
  ASSERT_EQ(g.assumed.size(), 1u);
  EXPECT_NE(g.assumed[0].find("the plane of the sensor's points"), std::string::npos) << g.assumed[0];
}

TEST_F(CaptureAssumed, ValuesAreWhatTheFileHas) {
  write_capture(path(), any_capture(3, 2, 0, 4));
  std::vector<double> h(24, 1.0);
  h[2 * 6 + 1 * 2 + 1] = -2.5;
  h[3 * 6] = std::numeric_limits<double>::quiet_NaN();
  replace("H", {4, 3, 2}, h);
  const GatedImage counts = read_capture(path()).counts;
  EXPECT_EQ(counts.at(1 * 3 + 1, 2, 0), -2.5);
  EXPECT_TRUE(std::isnan(counts.at(0, 3, 0)));
}

/// Points on a plane with an offset along its normal that no plane shares: the least squares normal is that of the plane.
TEST(PlaneNormal, IsThatOfLeastSquares) {
  std::mt19937 random(test_seed(4));
  for (int i = 0; i < 100; ++i) {
    const Vec3 normal = normalize(any_point(random)), u = normalize(cross(normal, any_point(random))),
               v = cross(normal, u);
    const double stretch = i % 2 == 0 ? 1 : 1e-3;
    std::vector<Vec3> points;
    // Symmetric in u and v, so that the offsets, alternating in sign, are not correlated with either.
    for (const double a : {-1.0, 1.0})
      for (const double b : {-1.0, 1.0})
        points.push_back(u * a + v * (b * stretch) + normal * (1e-4 * a * b * stretch));
    const auto found = plane_normal(points);
    ASSERT_TRUE(found);
    EXPECT_NEAR(std::abs(dot(*found, normal)), 1, 1e-9);
    EXPECT_EQ(std::max({found->x, found->y, found->z}),
              std::max({std::abs(found->x), std::abs(found->y), std::abs(found->z)}));
  }
  EXPECT_FALSE(plane_normal({{1, 2, 3}}));
  EXPECT_FALSE(plane_normal({{1, 2, 3}, {2, 3, 4}, {5, 6, 7}}));
}

}  // namespace
}  // namespace isochron
