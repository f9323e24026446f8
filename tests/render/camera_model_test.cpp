#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/scene/sensors/pinhole.h"

namespace isochron::testing {
namespace {

const Camera kCameras[] = {{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 90, 8, 8},
                           {{1.3, -0.4, 2.0}, {0.2, 0.7, -1.1}, {0.1, 1, 0.2}, 37, 33, 12},
                           {{-1e3, 2e3, 5e2}, {4e2, -3e2, 1e2}, {0, 0, 1}, 2.5, 5, 40}};

class CameraModelTest : public ::testing::TestWithParam<int> {
 protected:
  CameraModelTest() : given_(kCameras[GetParam()]), camera_(given_), rng_(Stream{7, 0, 0}, 0, 0) {}
  double in(double low, double high) { return low + (high - low) * rng_.uniform(); }
  Camera given_;
  CameraModel camera_;
  Rng rng_;
};

TEST_P(CameraModelTest, ProjectUndoesDirection) {
  for (int i = 0; i < 2000; ++i) {
    const double u = in(0, given_.width), v = in(0, given_.height);
    const Vec3 d = camera_.direction(u, v);
    EXPECT_NEAR(length(d), 1, 1e-14);
    const int pixel = static_cast<int>(v) * given_.width + static_cast<int>(u);
    const double du = u - std::floor(u), dv = v - std::floor(v);
    if (std::min({du, 1 - du, dv, 1 - dv}) < 1e-9) continue;  // on a pixel's border rounding decides
    const double distance = in(0.1, 5) * length(given_.look_at - given_.position);
    EXPECT_EQ(camera_.project(camera_.position + d * distance), pixel);
    EXPECT_EQ(camera_.project(camera_.position - d * distance), -1) << "behind";
  }
}

TEST_P(CameraModelTest, OutsideIsNoPixel) {
  const double w = given_.width, h = given_.height;
  const double outside[][2] = {{-0.01, h / 2}, {w + 0.01, h / 2}, {w / 2, -0.01}, {w / 2, h + 0.01}, {-1, -1}};
  for (const auto& uv : outside)
    EXPECT_EQ(camera_.project(camera_.position + camera_.direction(uv[0], uv[1]) * 3.0), -1);
}

/// Orientation and field of view from their definitions.
TEST_P(CameraModelTest, LooksWhereItShould) {
  const Vec3 forward = normalize(given_.look_at - given_.position);
  const double w = given_.width, h = given_.height;
  EXPECT_NEAR(length(camera_.direction(w / 2, h / 2) - forward), 0, 1e-14);
  const double across = std::acos(dot(camera_.direction(0, h / 2), camera_.direction(w, h / 2))) * 180 / kPi;
  EXPECT_NEAR(across, given_.fov, 1e-9);
  const Vec3 up = given_.up - forward * dot(given_.up, forward);
  EXPECT_GT(dot(camera_.direction(w / 2, 0), up), dot(camera_.direction(w / 2, h), up)) << "row 0 is at the top";
  const Vec3 right = cross(forward, given_.up);
  EXPECT_GT(dot(camera_.direction(w, h / 2), right), dot(camera_.direction(0, h / 2), right)) << "column 0 is left";
}

TEST_P(CameraModelTest, AreaPerSolidAngleIsTheJacobian) {
  for (int i = 0; i < 200; ++i) {
    const double u = in(0, given_.width), v = in(0, given_.height), step = 1e-4;
    const Vec3 du = (camera_.direction(u + step, v) - camera_.direction(u - step, v)) / (2 * step);
    const Vec3 dv = (camera_.direction(u, v + step) - camera_.direction(u, v - step)) / (2 * step);
    const double solid_angle = length(cross(du, dv));
    EXPECT_NEAR(camera_.image_area_per_solid_angle(camera_.direction(u, v)) * solid_angle, 1, 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(, CameraModelTest, ::testing::Values(0, 1, 2));

}  // namespace
}  // namespace isochron::testing
