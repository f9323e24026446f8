// Captures in HDF5. The library itself may crash where bytes of its headers were overwritten, so that the input describes data sets
// (which of them there are, their shapes, types and values) of a file that the library writes.
#include <hdf5.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include "core/image/capture_file.h"
#include "core/image/hdf5_file.h"
#include "tests/fuzz/harness.h"

using namespace isochron;

namespace {

class Input {
 public:
  Input(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  unsigned byte() { return at_ < size_ ? data_[at_++] : 0; }
  /// Numbers of every kind, those that decide something more often.
  double number() {
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN(),
                     kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kChosen[] = {0, 1, -1, 0.5, 1e-300, 1e300, kNan, kInfinity, -kInfinity, 2, 3, 4};
    const unsigned which = byte();
    if (which < 200) return kChosen[which % std::size(kChosen)];
    std::uint64_t bits = 0;
    for (int i = 0; i < 8; ++i) bits = bits << 8 | byte();
    double value;
    std::memcpy(&value, &bits, sizeof value);
    return value;
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_, at_ = 0;
};

void write_dataset(hid_t file, const char* name, const std::vector<hsize_t>& expected, Input& input) {
  constexpr unsigned kAsExpected = 128, kMissing = 10, kEmpty = 20, kText = 30;
  const unsigned kind = input.byte();
  if (kind < kMissing) return;
  std::vector<hsize_t> shape = expected;
  if (kind < kAsExpected) {
    shape.resize(input.byte() % 6);
    for (hsize_t& extent : shape) extent = input.byte() % 4;
  }
  hsize_t count = 1;
  for (const hsize_t extent : shape) count *= extent;
  std::vector<double> values(count);
  for (double& value : values) value = input.number();
  const bool empty = kind < kEmpty, text = !empty && kind < kText;
  const hid_t space = empty           ? H5Screate(H5S_NULL)
                      : shape.empty() ? H5Screate(H5S_SCALAR)
                                      : H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr);
  const hid_t dataset = H5Dcreate2(file, name,
                                   text            ? H5T_C_S1
                                   : kind % 2 == 0 ? H5T_NATIVE_DOUBLE
                                                   : H5T_NATIVE_FLOAT,
                                   space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  if (!empty && !text && count > 0) H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
  H5Dclose(dataset);
  H5Sclose(space);
}

void write_file(const std::string& path, Input& input) {
  const hsize_t columns = 1 + input.byte() % 3, rows = 1 + input.byte() % 3, spots = 1 + input.byte() % 3,
                bins = 1 + input.byte() % 4;
  const bool several = input.byte() % 2 == 0;
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const std::vector<hsize_t> sensor{columns, rows, 3}, laser = several ? std::vector<hsize_t>{spots, 1, 3} : sensor;
  write_dataset(
      file, "H",
      several ? std::vector<hsize_t>{bins, spots, 1, columns, rows} : std::vector<hsize_t>{bins, columns, rows}, input);
  write_dataset(file, "sensor_grid_xyz", sensor, input);
  write_dataset(file, "sensor_grid_normals", sensor, input);
  write_dataset(file, "laser_grid_xyz", laser, input);
  write_dataset(file, "laser_grid_normals", laser, input);
  for (const char* name : {"delta_t", "t_start", "t_accounts_first_and_last_bounces", "H_format"})
    write_dataset(file, name, {}, input);
  for (const char* name : {"laser_xyz", "sensor_xyz"}) write_dataset(file, name, {3}, input);
  H5Fclose(file);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzz::Folder folder;
  static const std::string path = folder.write("capture.h5", "", 0);
  Input input(data, size);
  write_file(path, input);
  fuzz::expect_result_or_input_error([&] {
    const CaptureFile capture = read_capture(path);
    const CaptureGeometry& g = capture.geometry;
    const auto points = static_cast<std::size_t>(g.columns) * static_cast<std::size_t>(g.rows);
    fuzz::require(points > 0 && g.sensor.size() == points && g.sensor_normal.size() == points,
                  "a capture has its points");
    fuzz::require(g.laser.size() == g.laser_normal.size() && g.confocal == g.laser.empty(), "spots have their normals");
    for (const auto* list : {&g.sensor, &g.sensor_normal, &g.laser, &g.laser_normal})
      for (const Vec3& v : *list) fuzz::require(fuzz::is_finite(v), "points and normals are finite");
    fuzz::require(capture.counts.pixels() == g.columns * g.rows * g.spots(), "every point has its counts");
    fuzz::require(capture.delta_t > 0 && std::isfinite(capture.delta_t + capture.t_start), "bins have a place");
  });
  return 0;
}
