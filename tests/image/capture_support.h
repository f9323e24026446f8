// Captures made in code, and files of them that are changed dataset by dataset.
#pragma once
#include <gtest/gtest.h>
#include <hdf5.h>

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "core/image/capture_file.h"
#include "tests/scene/temporary_folder.h"
#include "tests/seed.h"

namespace isochron {

inline Vec3 any_point(std::mt19937& random) {
  std::uniform_real_distribution<double> uniform(-1, 1);
  return {uniform(random), uniform(random), uniform(random)};
}

/// Confocal with 0 spots. Counts are whole numbers, which 32-bit floats keep.
inline CaptureFile any_capture(int columns, int rows, int spots, int bins) {
  std::mt19937 random(test_seed(3));
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
inline hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t native_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
inline hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
inline hid_t native_type<std::int16_t>() {
  return H5T_NATIVE_INT16;
}
template <>
inline hid_t native_type<std::uint16_t>() {
  return H5T_NATIVE_UINT16;
}
template <>
inline hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
inline hid_t native_type<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}

class CaptureTest : public testing::Test {
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

}  // namespace isochron
