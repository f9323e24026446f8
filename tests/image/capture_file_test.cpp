#include "core/image/capture_file.h"

#include <gtest/gtest.h>
#include <hdf5.h>
#include <sys/stat.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>

#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

Vec3 any_point(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return {uniform(random), uniform(random), uniform(random)};
}

/// Confocal with 0 spots. Counts are whole numbers, which 32-bit floats keep.
CaptureFile any_capture(int columns, int rows, int spots, int bins) {
  std::mt19937 random(3);
  CaptureFile capture;
  CaptureGeometry& geometry = capture.geometry;
  geometry.columns = columns;
  geometry.rows = rows;
  geometry.confocal = spots == 0;
  const auto fill = [&](std::vector<Vec3>& points, std::vector<Vec3>& normals, int count) {
    for (int i = 0; i < count; ++i) {
      points.push_back(any_point(random));
      normals.push_back(normalize(any_point(random)));
    }
  };
  fill(geometry.sensor, geometry.sensor_normal, columns * rows);
  fill(geometry.laser, geometry.laser_normal, spots);
  geometry.accounts_first_and_last = spots > 0;
  geometry.laser_origin = any_point(random);
  geometry.sensor_origin = any_point(random);
  capture.counts = GatedImage(columns, rows * geometry.spots(), bins, 1);
  for (double& count : capture.counts.data) count = static_cast<double>(random() % 1000);
  capture.delta_t = 0.0012;
  capture.t_start = -0.25;
  return capture;
}

template <class Number>
hid_t native_type();
template <>
hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
hid_t native_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
hid_t native_type<std::int16_t>() {
  return H5T_NATIVE_INT16;
}
template <>
hid_t native_type<std::uint16_t>() {
  return H5T_NATIVE_UINT16;
}
template <>
hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
hid_t native_type<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}

class Capture : public testing::Test {
 protected:
  std::string path(const std::string& name = "f.h5") { return folder.path(name); }

  void remove(const char* name) {
    const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    ASSERT_GE(H5Ldelete(file, name, H5P_DEFAULT), 0) << name;
    H5Fclose(file);
  }
  /// Replaces a dataset; compressed and in chunks of two along the first dimension where `compressed`.
  template <class Number = double>
  void replace(const char* name, const std::vector<hsize_t>& shape, const std::vector<Number>& values,
               bool compressed = false) {
    const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    if (H5Lexists(file, name, H5P_DEFAULT) > 0) H5Ldelete(file, name, H5P_DEFAULT);
    const hid_t space =
        shape.empty() ? H5Screate(H5S_SCALAR) : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
    const hid_t properties = H5Pcreate(H5P_DATASET_CREATE);
    if (compressed) {
      std::vector<hsize_t> chunk = shape;
      chunk[0] = 2;
      H5Pset_chunk(properties, static_cast<int>(chunk.size()), chunk.data());
      H5Pset_deflate(properties, 4);
    }
    const hid_t type = native_type<Number>();
    const hid_t dataset = H5Dcreate2(file, name, type, space, H5P_DEFAULT, properties, H5P_DEFAULT);
    ASSERT_GE(H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
    H5Dclose(dataset);
    H5Pclose(properties);
    H5Sclose(space);
    H5Fclose(file);
  }
  std::string message(const std::string& message) {
    EXPECT_EQ(message.find('\n'), std::string::npos);
    return message.starts_with(path() + ": ") ? message.substr(path().size() + 2) : message;
  }
  std::string read_error() {
    return message(error_of([&] { read_capture(path()); }));
  }
  std::string geometry_error() {
    return message(error_of([&] { read_capture_geometry(path()); }));
  }
  /// The error after one dataset has been replaced in a good confocal file of 3 x 2 points and 4 bins.
  std::string error_with(const char* name, const std::vector<hsize_t>& shape, const std::vector<double>& values) {
    write_capture(path(), any_capture(3, 2, 0, 4));
    replace(name, shape, values);
    return read_error();
  }

  TemporaryFolder folder;
};

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

TEST_F(Capture, ErrorsOfShapes) {
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

TEST_F(Capture, ErrorsOfValues) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  std::vector<double> h(24, 1.0);
  h[2 * 6 + 1 * 2 + 1] = -1;
  EXPECT_EQ(error_with("H", {4, 3, 2}, h), "H is -1 in bin 2, column 1, row 1: no number of photons");
  h[2 * 6 + 1 * 2 + 1] = nan;
  EXPECT_EQ(error_with("H", {4, 3, 2}, h), "H is nan in bin 2, column 1, row 1: no number of photons");
  h[2 * 6 + 1 * 2 + 1] = infinity;
  EXPECT_EQ(error_with("H", {4, 3, 2}, h), "H is inf in bin 2, column 1, row 1: no number of photons");
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

TEST_F(Capture, ErrorsOfWhatIsMissing) {
  for (const char* name : {"H", "sensor_grid_xyz", "sensor_grid_normals", "laser_grid_xyz", "laser_grid_normals",
                           "delta_t", "t_start", "t_accounts_first_and_last_bounces", "laser_xyz", "sensor_xyz"}) {
    write_capture(path(), any_capture(3, 2, 2, 4));
    remove(name);
    EXPECT_EQ(read_error(), std::string(name) + " is missing");
    // As h5py writes None.
    const hid_t file = H5Fopen(path().c_str(), H5F_ACC_RDWR, H5P_DEFAULT), space = H5Screate(H5S_NULL);
    H5Dclose(H5Dcreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    H5Sclose(space);
    H5Fclose(file);
    EXPECT_EQ(read_error(), std::string(name) + " is missing");
  }
  write_capture(path(), any_capture(3, 2, 0, 4));  // its times leave out the ways to the wall
  remove("laser_xyz");
  remove("sensor_xyz");
  EXPECT_EQ(read_error(), "no error");
  remove("sensor_grid_normals");
  EXPECT_EQ(geometry_error(), "sensor_grid_normals is missing");
}

TEST_F(Capture, ErrorsOfFiles) {
  EXPECT_EQ(read_error(), "cannot be opened: No such file or directory");
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

TEST_F(Capture, WhatDoesNotFitTogetherIsNotWritten) {
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

TEST_F(Capture, TruncatedFilesAreErrors) {
  write_capture(path(), any_capture(3, 2, 2, 4));
  const std::string whole = folder.read("f.h5");
  for (std::size_t size = 0; size < whole.size(); size += size < 600 ? 1 : 37) {
    folder.write("f.h5", whole.substr(0, size));
    EXPECT_TRUE(read_error().starts_with("cannot be read as HDF5: ")) << size << ": " << read_error();
  }
}

TEST_F(Capture, DeclaredSizesAreNotBelieved) {
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

TEST_F(Capture, H5pyReadsIt) {
  const auto run = [&](const std::string& script) {
    return std::system(("/usr/bin/python3 -c '" + script + "' 2>" + path("errors")).c_str());
  };
  if (run("import h5py") != 0) GTEST_SKIP() << "there is no h5py here";
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
  EXPECT_EQ(run(script), 0) << folder.read("errors");
}

}  // namespace
}  // namespace isochron
