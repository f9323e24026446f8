#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/stat.h>

#include <limits>
#include <stdexcept>
#include <utility>

#include "tests/image/capture_support.h"

namespace isochron {
namespace {

class CaptureErrors : public CaptureTest {};

TEST_F(CaptureErrors, OfShapes) {
  const std::vector<double> one(1000, 1.0);
  EXPECT_EQ(error_with("H", {4, 3, 1}, one), "H has 3 dimensions of 4 x 3 x 1, the sensor grid has 3 x 2");
  EXPECT_EQ(error_with("H", {4, 2, 3}, one), "H has 3 dimensions of 4 x 2 x 3, the sensor grid has 3 x 2");
  EXPECT_EQ(error_with("H", {3, 2}, one), "H has 2 dimensions of 3 x 2, the sensor grid has 3 x 2");
  EXPECT_EQ(error_with("H", {}, one), "H has 0 dimensions of , the sensor grid has 3 x 2");
  EXPECT_EQ(error_with("H", {4, 2, 1, 1, 3, 2}, one),
            "H has 6 dimensions of 4 x 2 x 1 x 1 x 3 x 2, the sensor grid has 3 x 2");
  EXPECT_EQ(error_with("H", {4, 5, 1, 3, 2}, one), "H has 5 x 1 laser points, the laser grid has 3 x 2");
  EXPECT_EQ(error_with("H", {0, 3, 2}, one), "H has 0 bins");
  EXPECT_EQ(error_with("sensor_grid_xyz", {6}, one), "sensor_grid_xyz has 6 values, not [X, Y, 3] or [N, 3]");
  EXPECT_EQ(error_with("sensor_grid_xyz", {3, 2, 2}, one),
            "sensor_grid_xyz has 3 x 2 x 2 values, not [X, Y, 3] or [N, 3]");
  EXPECT_EQ(error_with("sensor_grid_xyz", {0, 3}, one), "sensor_grid_xyz has 0 points");
  EXPECT_EQ(error_with("sensor_grid_normals", {2, 3, 3}, one),
            "sensor_grid_normals has 2 x 3 normals for 3 x 2 points");
  EXPECT_EQ(error_with("delta_t", {2}, one), "delta_t has 2 values, not one");
  EXPECT_EQ(error_with("laser_xyz", {4}, one), "laser_xyz has 4 values, not 3");
}

TEST_F(CaptureErrors, OfValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  std::vector<double> grid(18, 1.0);
  grid[2 * 6 + 1 * 3 + 2] = nan;
  EXPECT_EQ(error_with("sensor_grid_xyz", {3, 2, 3}, grid), "sensor_grid_xyz is not finite at 2, 1");
  EXPECT_EQ(error_with("laser_grid_xyz", {3, 2, 3}, grid), "laser_grid_xyz is not finite at 2, 1");
  EXPECT_EQ(error_with("sensor_grid_normals", {3, 2, 3}, grid), "sensor_grid_normals is not finite at 2, 1");
  for (int i = 15; i < 18; ++i) grid[i] = 0;
  EXPECT_EQ(error_with("sensor_grid_normals", {3, 2, 3}, grid), "sensor_grid_normals has no direction at 2, 1");
  for (const auto& [value, text] : {std::pair{0.0, "0"}, std::pair{-2.0, "-2"}})
    EXPECT_EQ(error_with("delta_t", {}, {value}), std::string("delta_t is ") + text + ", not positive");
  EXPECT_EQ(error_with("delta_t", {}, {nan}), "delta_t is nan");
  EXPECT_EQ(error_with("t_start", {1}, {infinity}), "t_start is inf");
  EXPECT_EQ(error_with("laser_xyz", {3}, {0, nan, 0}), "laser_xyz is not finite");
  EXPECT_EQ(error_with("H_format", {1}, {7}), "H_format 7 is not one of counts in time");
}

TEST_F(CaptureErrors, OfWhatIsMissing) {
  const auto missing = [](const std::string& name) { return name + " is missing"; };
  for (const char* name : {"H", "sensor_grid_xyz", "laser_grid_xyz", "delta_t", "t_accounts_first_and_last_bounces",
                           "laser_xyz", "sensor_xyz"}) {
    write_capture(path(), any_capture(3, 2, 2, 4));
    remove(name);
    EXPECT_EQ(read_error(), missing(name));
    // As h5py writes None.
    const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT), space = H5Screate(H5S_NULL);
    H5Dclose(H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(space);
    H5Fclose(file);
    EXPECT_EQ(read_error(), missing(name));
  }
  write_capture(path(), any_capture(3, 2, 0, 4));  // its times leave out the ways to the wall
  remove("laser_xyz");
  remove("sensor_xyz");
  EXPECT_EQ(read_error(), "no error");
  write_capture(path(), any_capture(3, 1, 0, 4));
  remove("sensor_grid_normals");
  replace("sensor_grid_xyz", {3, 1, 3}, {0, 0, 0, 1, 2, 0, 2, 4, 0});
  EXPECT_EQ(geometry_error(), "sensor_grid_normals is missing, and the points span no plane");
}

TEST_F(CaptureErrors, OfFiles) {
  EXPECT_TRUE(read_error().starts_with("does not exist (a measurement has to be had first")) << read_error();
  folder.write("f.h5", "no capture");
  testing::internal::CaptureStderr();
  EXPECT_TRUE(read_error().starts_with("cannot be read as HDF5: ")) << read_error();
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  folder.write("sub/keep", "x");
  EXPECT_EQ(error_of([&] { read_capture(path("sub")); }), path("sub") + ": is a folder");
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_EQ(error_of([&] { read_capture_geometry(path("pipe")); }),
            path("pipe") + ": is a pipe or a device, not a regular file");
  const CaptureFile capture = any_capture(3, 2, 0, 4);
  EXPECT_EQ(error_of([&] { write_capture(path("none/f.h5"), capture); }),
            path("none/f.h5") + ": cannot be written: No such file or directory");
  EXPECT_EQ(error_of([&] { write_capture(path("sub"), capture); }),
            path("sub") + ": cannot be written: Is a directory");
  EXPECT_EQ(folder.entries(), 3);
}

TEST_F(CaptureErrors, WhatDoesNotFitTogetherIsNotWritten) {
  const CaptureFile capture = any_capture(3, 2, 2, 4);
  const auto expect_refused = [&](auto&& change) {
    CaptureFile changed = capture;
    change(changed);
    EXPECT_THROW(write_capture(path(), changed), std::invalid_argument);
  };
  expect_refused([](CaptureFile& c) { c.geometry.sensor.pop_back(); });
  expect_refused([](CaptureFile& c) { c.geometry.sensor_normal.clear(); });
  expect_refused([](CaptureFile& c) { c.geometry.laser_normal.pop_back(); });
  expect_refused([](CaptureFile& c) { c.geometry.laser.clear(); });
  expect_refused([](CaptureFile& c) { c.geometry.confocal = true; });
  expect_refused([](CaptureFile& c) { c.counts = GatedImage(3, 4, 4, 3); });
  expect_refused([](CaptureFile& c) { c.delta_t = 0; });
  EXPECT_EQ(folder.entries(), 0);
}

TEST_F(CaptureErrors, TruncatedFilesAreErrors) {
  write_capture(path(), any_capture(3, 2, 2, 4));
  const std::string whole = folder.read("f.h5");
  for (std::size_t size = 0; size < whole.size(); size += size < 600 ? 1 : 37) {
    folder.write("f.h5", whole.substr(0, size));
    EXPECT_TRUE(read_error().starts_with("cannot be read as HDF5: ")) << size << ": " << read_error();
  }
}

TEST_F(CaptureErrors, DeclaredSizesAreNotBelieved) {
  write_capture(path(), any_capture(3, 2, 0, 4));
  remove("H");
  const hsize_t sizes[] = {hsize_t{1} << 40, 3, 2}, fewer[] = {hsize_t{1} << 30, 3, 2}, chunk[] = {1024, 3, 2};
  for (const auto& [shape, error] : {std::pair{sizes, "H has 1099511627776 bins"},
                                     std::pair{fewer, "H of 1073741824 x 3 x 2 values holds 0 bytes only"}}) {
    const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT), properties = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(properties, 3, chunk);
    H5Pset_deflate(properties, 4);
    const hid_t space = H5Screate_simple(3, shape, nullptr);
    H5Dclose(H5Dcreate2(file, "H", H5T_NATIVE_FLOAT, space, H5P_DEFAULT, properties, H5P_DEFAULT));
    H5Sclose(space);
    H5Pclose(properties);
    H5Fclose(file);
    EXPECT_EQ(read_error(), error);
    remove("H");
  }
}

}  // namespace
}  // namespace isochron
