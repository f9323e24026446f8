#include "core/image/capture_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tests/image/capture_support.h"

namespace isochron {
namespace {

class Capture : public CaptureTest {};

void expect_same(const CaptureGeometry& a, const CaptureGeometry& b) {
  EXPECT_EQ(a.columns, b.columns);
  EXPECT_EQ(a.rows, b.rows);
  EXPECT_EQ(a.confocal, b.confocal);
  EXPECT_EQ(a.sensor, b.sensor);
  EXPECT_EQ(a.laser, b.laser);
  for (const auto& [x, y] :
       {std::pair{&a.sensor_normal, &b.sensor_normal}, std::pair{&a.laser_normal, &b.laser_normal}}) {
    ASSERT_EQ(x->size(), y->size());
    for (std::size_t i = 0; i < x->size(); ++i) EXPECT_LT(length((*x)[i] - (*y)[i]), 1e-15);
  }
  EXPECT_EQ(a.accounts_first_and_last, b.accounts_first_and_last);
  EXPECT_EQ(a.laser_origin, b.laser_origin);
  EXPECT_EQ(a.sensor_origin, b.sensor_origin);
}

TEST_F(Capture, RoundTrip) {
  for (const int spots : {0, 1, 3}) {
    const CaptureFile capture = any_capture(4, 3, spots, 5);
    write_capture(path(), capture);
    const CaptureFile back = read_capture(path());
    expect_same(back.geometry, capture.geometry);
    expect_same(read_capture_geometry(path()), capture.geometry);
    ASSERT_TRUE(back.counts.same_shape(capture.counts));
    EXPECT_EQ(back.counts.data, capture.counts.data);
    EXPECT_EQ(back.delta_t, 0.0012);
    EXPECT_EQ(back.t_start, -0.25);
    EXPECT_EQ(folder.entries(), 1);
  }
}

TEST_F(Capture, RoundTripInSlabs) {
  const CaptureFile capture = any_capture(90, 70, 2, 170);  // two million values: two slabs, the second not full
  write_capture(path(), capture);
  EXPECT_EQ(read_capture(path()).counts.data, capture.counts.data);
}

TEST_F(Capture, AxesAreTimeColumnRow) {
  write_capture(path(), any_capture(3, 2, 0, 4));
  std::vector<double> h;
  for (int bin = 0; bin < 4; ++bin) {
    for (int column = 0; column < 3; ++column) {
      for (int row = 0; row < 2; ++row) h.push_back(100 * bin + 10 * column + row);
    }
  }
  std::vector<double> points;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 2; ++row) points.insert(points.end(), {1.0 * column, -1.0 * row, 0});
  }
  replace("H", {4, 3, 2}, h);
  replace("sensor_grid_xyz", {3, 2, 3}, points);
  replace("laser_grid_xyz", {3, 2, 3}, points);
  const CaptureFile capture = read_capture(path());
  for (int row = 0; row < 2; ++row) {
    for (int column = 0; column < 3; ++column) {
      EXPECT_EQ(capture.geometry.sensor[row * 3 + column], (Vec3{1.0 * column, -1.0 * row, 0}));
      for (int bin = 0; bin < 4; ++bin)
        EXPECT_EQ(capture.counts.at(row * 3 + column, bin), 100 * bin + 10 * column + row);
    }
  }
}

TEST_F(Capture, GridsOfSpots) {
  write_capture(path(), any_capture(2, 1, 6, 1));
  std::vector<double> h, points;
  for (int lx = 0; lx < 3; ++lx) {
    for (int ly = 0; ly < 2; ++ly) {
      points.insert(points.end(), {1.0 * lx, 1.0 * ly, 0});
      for (int column = 0; column < 2; ++column) h.push_back(100 * lx + 10 * ly + column);
    }
  }
  replace("H", {1, 3, 2, 2, 1}, h);
  EXPECT_EQ(read_error(), "H has 3 x 2 laser points, the laser grid has 6 x 1");
  replace("laser_grid_xyz", {3, 2, 3}, points);
  EXPECT_EQ(read_error(), "laser_grid_normals has 6 x 1 normals for 3 x 2 points");
  replace("laser_grid_normals", {3, 2, 3}, std::vector<double>(18, 2.0));
  const CaptureFile capture = read_capture(path());
  EXPECT_EQ(capture.counts.height, 6);
  for (int spot = 0; spot < 6; ++spot) {
    const int lx = spot % 3, ly = spot / 3;
    EXPECT_EQ(capture.geometry.laser[spot], (Vec3{1.0 * lx, 1.0 * ly, 0}));
    EXPECT_NEAR(capture.geometry.laser_normal[spot].x, std::sqrt(1 / 3.0), 1e-15);
    for (int column = 0; column < 2; ++column)
      EXPECT_EQ(capture.counts.at(spot * 2 + column, 0), 100 * lx + 10 * ly + column);
  }
}

TEST_F(Capture, PointsInNoOrder) {
  const CaptureFile capture = any_capture(6, 1, 2, 2);
  write_capture(path(), capture);
  std::vector<double> points, normals;
  for (int i = 0; i < 6; ++i) {
    const Vec3 &p = capture.geometry.sensor[i], &n = capture.geometry.sensor_normal[i];
    points.insert(points.end(), {p.x, p.y, p.z});
    normals.insert(normals.end(), {n.x, n.y, n.z});
  }
  replace("sensor_grid_xyz", {6, 3}, points);
  replace("sensor_grid_normals", {6, 3}, normals);
  std::vector<double> h;
  for (int i = 0; i < 24; ++i) h.push_back(i);
  replace("H", {2, 2, 6}, h);  // bins, spots, sensor points
  const CaptureFile back = read_capture(path());
  EXPECT_EQ(back.geometry.sensor, capture.geometry.sensor);
  EXPECT_EQ(back.counts.width, 6);
  EXPECT_EQ(back.counts.height, 2);
  EXPECT_EQ(back.counts.data, (std::vector<double>{0, 12, 1, 13, 2, 14, 3, 15, 4,  16, 5,  17,
                                                   6, 18, 7, 19, 8, 20, 9, 21, 10, 22, 11, 23}));
  replace("H", {2, 6}, std::vector<double>(12, 1.0));
  EXPECT_EQ(read_error(), "H has no dimensions for the laser's 2 x 1 points, which are neither one nor the sensor's");
  remove("laser_grid_xyz");
  EXPECT_TRUE(read_capture(path()).geometry.confocal);
}

TEST_F(Capture, WithoutCountsThereIsAGeometry) {
  for (const int spots : {0, 1, 3}) {
    const CaptureFile capture = any_capture(3, 2, spots, 4);
    write_capture(path(), capture);
    for (const char* name : {"H", "delta_t", "t_start", "H_format", "scene_info"}) remove(name);
    expect_same(read_capture_geometry(path()), capture.geometry);
    replace("delta_t", {}, std::vector<double>{1.0});
    replace("t_start", {1}, std::vector<double>{0.0});
    EXPECT_EQ(read_error(), "H is missing");
  }
}

TEST_F(Capture, LaserAtTheSensorPointsIsConfocal) {
  const CaptureFile capture = any_capture(3, 2, 0, 4);
  write_capture(path(), capture);
  std::vector<double> rounded;
  for (int column = 0; column < 3; ++column) {
    for (int row = 0; row < 2; ++row) {
      const Vec3& p = capture.geometry.sensor[row * 3 + column];
      for (const double x : {p.x, p.y, p.z}) rounded.push_back(static_cast<float>(x));
    }
  }
  replace("laser_grid_xyz", {3, 2, 3}, rounded);
  EXPECT_TRUE(read_capture(path()).geometry.confocal);
  rounded[4] += 0.01;
  replace("laser_grid_xyz", {3, 2, 3}, rounded);
  EXPECT_EQ(read_error(), "H has no dimensions for the laser's 3 x 2 points, which are neither one nor the sensor's");
  remove("laser_grid_xyz");
  remove("laser_grid_normals");
  expect_same(read_capture(path()).geometry, capture.geometry);
}

template <class Number>
class CaptureOf : public Capture {};
using Numbers = testing::Types<double, float, std::uint8_t, std::int16_t, std::uint16_t, std::int32_t, std::uint64_t>;
TYPED_TEST_SUITE(CaptureOf, Numbers);

TYPED_TEST(CaptureOf, EveryKindOfNumber) {
  write_capture(this->path(), any_capture(3, 2, 0, 5));
  std::vector<TypeParam> h;
  for (int i = 0; i < 30; ++i) h.push_back(static_cast<TypeParam>(i));
  for (const bool compressed : {false, true}) {
    this->replace("H", {5, 3, 2}, h, compressed);
    const CaptureFile capture = read_capture(this->path());
    for (int pixel = 0; pixel < 6; ++pixel) {
      for (int bin = 0; bin < 5; ++bin) EXPECT_EQ(capture.counts.at(pixel, bin), bin * 6 + pixel % 3 * 2 + pixel / 3);
    }
  }
}

class CapturePython : public Capture {
 protected:
  void SetUp() override {
    if (run("-c 'import h5py, scipy'") != 0) GTEST_SKIP() << "there is no h5py here";
  }
  int run(const std::string& arguments) {
    return std::system(("/usr/bin/python3 " + arguments + " >" + path("said") + " 2>&1").c_str());
  }
};

TEST_F(CapturePython, ImportedCapturesAreRead) {
  ASSERT_EQ(run("-c 'import numpy as np; np.save(\"" + path("in.npy") + "\", np.arange(24).reshape(3, 2, 4))'"), 0);
  ASSERT_EQ(run(PROJECT_ROOT "/scripts/import_capture.py " + path("in.npy") + " " + path() +
                " --bin-ps 10 --width 0.5 --rebin 2"),
            0)
      << folder.read("said");
  const CaptureFile capture = read_capture(path());
  EXPECT_TRUE(capture.geometry.confocal);
  EXPECT_EQ(capture.geometry.sensor[5], (Vec3{0.5, -0.5, 0}));
  EXPECT_EQ(capture.geometry.sensor_normal[5], (Vec3{0, 0, 1}));
  EXPECT_NEAR(capture.delta_t, 20e-12 * 299792458, 1e-15);
  ASSERT_TRUE(capture.counts.same_shape(GatedImage(3, 2, 2, 1)));
  EXPECT_EQ(capture.counts.at(1 * 3 + 2, 1), 22 + 23);
}

TEST_F(CapturePython, H5pyReadsIt) {
  write_capture(path("single.h5"), any_capture(4, 3, 0, 5));
  write_capture(path("several.h5"), any_capture(4, 3, 2, 5));
  const std::string script = R"(
import h5py
known = "H H_format delta_t laser_grid_format laser_grid_normals laser_grid_xyz laser_xyz scene_info"
known += " sensor_grid_format sensor_grid_normals sensor_grid_xyz sensor_xyz t_accounts_first_and_last_bounces t_start"
for name, number, h, laser, accounts in (("single", 1, (5, 4, 3), (4, 3, 3), False),
                                         ("several", 2, (5, 2, 1, 4, 3), (2, 1, 3), True)):
    f = h5py.File(")" + path("") +
                             R"(" + name + ".h5", "r")
    assert sorted(f) == known.split(), sorted(f)
    assert f["H"].shape == h and f["H"].dtype == "f4"
    assert f["laser_grid_xyz"].shape == f["laser_grid_normals"].shape == laser
    assert f["sensor_grid_xyz"].shape == f["sensor_grid_normals"].shape == (4, 3, 3)
    assert f["H_format"].shape == (1,) and f["H_format"][0] == number
    assert h5py.check_enum_dtype(f["sensor_grid_format"].dtype)["X_Y_3"] == f["laser_grid_format"][0]
    assert f["t_accounts_first_and_last_bounces"][()].dtype == bool
    assert f["t_accounts_first_and_last_bounces"][()] == accounts
    assert f["delta_t"][()] == 0.0012 and f["laser_xyz"].shape == (3,)
    assert f["scene_info"].asstr()[()] == "{original_format: isochron}"
)";
  EXPECT_EQ(run("-c '" + script + "'"), 0) << folder.read("said");
}

}  // namespace
}  // namespace isochron
