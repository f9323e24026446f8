#include "core/image/capture_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>

#include "core/base/file.h"
#include "core/image/hdf5_file.h"
#include "core/image/wall_plane.h"

namespace isochron {
namespace {

constexpr std::size_t kSlabValues = std::size_t{1} << 20;  // read and written at a time
constexpr double kSamePoint = 1e-5;                        // of a grid's extent: grids may be rounded to 32 bits

/// A grid of points as the file has it: `shape` without the last dimension (3), points row after row.
struct Grid {
  Hdf5Shape shape;
  std::vector<Vec3> points;

  std::size_t columns() const { return shape[0]; }
  std::size_t rows() const { return shape.size() == 2 ? shape[1] : 1; }
};

Grid read_grid(const Hdf5Reader& reader, const char* name) {
  constexpr std::size_t kMostPoints = std::size_t{1} << 28;  // so that their number, and that of rows, is an int
  Grid grid{reader.shape(name), {}};
  const Hdf5Shape declared = grid.shape;
  if (declared.size() < 2 || declared.size() > 3 || declared.back() != 3)
    reader.fail(fmt::format("{} has {} values, not [X, Y, 3] or [N, 3]", name, to_text(declared)));
  grid.shape.pop_back();
  for (const std::size_t size : grid.shape) {
    if (size < 1 || size > kMostPoints) reader.fail(fmt::format("{} has {} points", name, to_text(grid.shape)));
  }
  const std::vector<double> values = reader.read(name);
  grid.points.resize(values.size() / 3);
  for (std::size_t column = 0, i = 0; column < grid.columns(); ++column) {
    for (std::size_t row = 0; row < grid.rows(); ++row, i += 3) {
      const Vec3 point{values[i], values[i + 1], values[i + 2]};
      if (!std::isfinite(point.x + point.y + point.z))
        reader.fail(fmt::format("{} is not finite at {}, {}", name, column, row));
      grid.points[row * grid.columns() + column] = point;
    }
  }
  return grid;
}

std::vector<Vec3> read_normals(const Hdf5Reader& reader, const char* name, const Grid& grid) {
  Grid normals = read_grid(reader, name);
  if (normals.shape != grid.shape)
    reader.fail(fmt::format("{} has {} normals for {} points", name, to_text(normals.shape), to_text(grid.shape)));
  for (std::size_t i = 0; i < normals.points.size(); ++i) {
    const double size = length(normals.points[i]);
    if (!(size > 0) || !std::isfinite(size))
      reader.fail(fmt::format("{} has no direction at {}, {}", name, i % grid.columns(), i / grid.columns()));
    normals.points[i] = normals.points[i] / size;
  }
  return normals.points;
}

/// Turns a wall's normal to the side where laser and sensor stand, if they are not in its plane.
Vec3 towards_the_instrument(const Vec3& normal, const Grid& grid, const CaptureGeometry& geometry) {
  constexpr double kInThePlane = 1e-3;                   // of the distance
  if (!geometry.accounts_first_and_last) return normal;  // then files have zeros for them
  for (const Vec3& origin : {geometry.sensor_origin, geometry.laser_origin}) {
    const Vec3 way = origin - grid.points[0];
    const double height = dot(way, normal);
    if (std::abs(height) > kInThePlane * length(way)) return height > 0 ? normal : normal * -1;
  }
  return normal;
}

/// The file's normals or, where it has none, those of the plane that the grid spans or else of `wall`.
std::vector<Vec3> find_normals(const Hdf5Reader& reader, const char* name, const Grid& grid, CaptureGeometry& geometry,
                               const std::optional<Vec3>& wall = std::nullopt) {
  if (reader.has_values(name)) return read_normals(reader, name, grid);
  const std::optional<Vec3> own = plane_normal(grid.points);
  if (!own && !wall) reader.fail(fmt::format("{} is missing, and the points span no plane", name));
  const Vec3 normal = own ? towards_the_instrument(*own, grid, geometry) : *wall;
  geometry.assumed.push_back(
      fmt::format("{} is missing: the wall is taken as the plane of {}, its normal as "
                  "({:.4g}, {:.4g}, {:.4g})",
                  name, own ? "its points" : "the sensor's points", normal.x, normal.y, normal.z));
  return std::vector<Vec3>(grid.points.size(), normal);
}

double read_number(const Hdf5Reader& reader, const char* name) {
  const Hdf5Shape shape = reader.shape(name);
  if (std::any_of(shape.begin(), shape.end(), [](std::size_t size) { return size != 1; }))
    reader.fail(fmt::format("{} has {} values, not one", name, to_text(shape)));
  const double value = reader.read(name)[0];
  if (!std::isfinite(value)) reader.fail(fmt::format("{} is {}", name, value));
  return value;
}

Vec3 read_point(const Hdf5Reader& reader, const char* name) {
  const Hdf5Shape shape = reader.shape(name);
  const std::vector<double> values = reader.read(name);
  if (values.size() != 3) reader.fail(fmt::format("{} has {} values, not 3", name, to_text(shape)));
  const Vec3 point{values[0], values[1], values[2]};
  if (!std::isfinite(point.x + point.y + point.z)) reader.fail(fmt::format("{} is not finite", name));
  return point;
}

bool are_same(const Grid& a, const Grid& b) {
  if (a.points.size() != b.points.size()) return false;
  double extent = 0, difference = 0;
  for (std::size_t i = 0; i < a.points.size(); ++i) {
    extent = std::max({extent, length(a.points[i] - a.points[0]), length(a.points[i])});
    difference = std::max(difference, length(a.points[i] - b.points[i]));
  }
  return difference <= kSamePoint * extent;
}

/// What H's dimensions behind the first say: those of the laser points, if they are there, and those of the sensor.
/// Empty without H.
std::optional<Hdf5Shape> laser_shape_of(const Hdf5Reader& reader, const Grid& sensor) {
  if (!reader.has("H")) return std::nullopt;
  const Hdf5Shape shape = reader.shape("H");
  const std::size_t behind = sensor.shape.size();
  if (shape.size() < 1 + behind || shape.size() > 3 + behind ||
      !std::equal(sensor.shape.begin(), sensor.shape.end(), shape.end() - static_cast<std::ptrdiff_t>(behind)))
    reader.fail(fmt::format("H has {} dimensions of {}, the sensor grid has {}", shape.size(), to_text(shape),
                            to_text(sensor.shape)));
  return Hdf5Shape(shape.begin() + 1, shape.end() - static_cast<std::ptrdiff_t>(behind));
}

/// Whether every sensor point has its own laser point. Checks that what is there fits together.
bool is_confocal(const Hdf5Reader& reader, const Grid& sensor, const std::optional<Grid>& laser) {
  const std::optional<Hdf5Shape> found = laser_shape_of(reader, sensor);
  if (found && !found->empty()) {
    if (!laser) reader.fail("laser_grid_xyz is missing");
    std::size_t count = 1;
    for (const std::size_t size : *found) count *= size;
    const bool same_shape = found->size() == 1 || laser->shape.size() == 1 || *found == laser->shape;
    if (!same_shape || count != laser->points.size())
      reader.fail(fmt::format("H has {} laser points, the laser grid has {}", to_text(*found), to_text(laser->shape)));
    return false;
  }
  if (!laser || are_same(*laser, sensor)) return true;
  if (found && laser->points.size() != 1)
    reader.fail(fmt::format("H has no dimensions for the laser's {} points, which are neither one nor the sensor's",
                            to_text(laser->shape)));
  return false;
}

CaptureGeometry read_geometry(const Hdf5Reader& reader) {
  constexpr double kLastInTime = 4;  // of tal's formats; those that follow are spectra
  if (reader.has("H_format")) {
    const double format = read_number(reader, "H_format");
    if (format < 0 || format > kLastInTime)
      reader.fail(fmt::format("H_format {} is not one of counts in time", format));
  }
  const Grid sensor = read_grid(reader, "sensor_grid_xyz");
  std::optional<Grid> laser;
  if (reader.has("laser_grid_xyz")) laser = read_grid(reader, "laser_grid_xyz");

  CaptureGeometry geometry;
  geometry.columns = static_cast<int>(sensor.columns());
  geometry.rows = static_cast<int>(sensor.rows());
  geometry.accounts_first_and_last = read_number(reader, "t_accounts_first_and_last_bounces") != 0;
  for (const auto& [name, origin] :
       {std::pair{"laser_xyz", &geometry.laser_origin}, std::pair{"sensor_xyz", &geometry.sensor_origin}}) {
    if (geometry.accounts_first_and_last || reader.has(name)) *origin = read_point(reader, name);
  }
  geometry.sensor_normal = find_normals(reader, "sensor_grid_normals", sensor, geometry);
  geometry.confocal = is_confocal(reader, sensor, laser);
  if (!geometry.confocal) {
    geometry.laser_normal = find_normals(reader, "laser_grid_normals", *laser, geometry, geometry.sensor_normal[0]);
    geometry.laser = laser->points;
    if (sensor.rows() * laser->points.size() > std::numeric_limits<int>::max())
      reader.fail(fmt::format("{} laser points are too many", laser->points.size()));
  }
  geometry.sensor = sensor.points;
  return geometry;
}

/// Sizes of H behind the time: of the laser points (one by one where it has no such dimensions) and of the sensor.
struct Layout {
  std::size_t laser_columns = 1, laser_rows = 1, columns = 1, rows = 1;

  std::size_t size() const { return laser_columns * laser_rows * columns * rows; }
  /// Calls visit(index in H behind the time, pixel of the image) in H's order.
  template <class Visit>
  void for_each(Visit&& visit) const {
    std::size_t i = 0;
    for (std::size_t lx = 0; lx < laser_columns; ++lx) {
      for (std::size_t ly = 0; ly < laser_rows; ++ly) {
        const std::size_t spot = ly * laser_columns + lx;
        for (std::size_t column = 0; column < columns; ++column) {
          for (std::size_t row = 0; row < rows; ++row, ++i) visit(i, (spot * rows + row) * columns + column);
        }
      }
    }
  }
};

Layout layout_of(const Hdf5Shape& laser, const CaptureGeometry& geometry) {
  Layout layout;
  if (!laser.empty()) layout.laser_columns = laser[0];
  if (laser.size() == 2) layout.laser_rows = laser[1];
  layout.columns = static_cast<std::size_t>(geometry.columns);
  layout.rows = static_cast<std::size_t>(geometry.rows);
  return layout;
}

template <class Image>
void require_fit(const CaptureGeometry& geometry, double delta_t, const Image& counts) {
  const std::size_t points = static_cast<std::size_t>(geometry.columns) * static_cast<std::size_t>(geometry.rows);
  if (points < 1 || geometry.sensor.size() != points || geometry.sensor_normal.size() != points ||
      geometry.spots() < 1 || (!geometry.confocal && geometry.laser_normal.size() != geometry.laser.size()))
    throw std::invalid_argument("a capture needs a position and a normal of every point of its grids");
  if (counts.width != geometry.columns || counts.height != geometry.rows * geometry.spots() || counts.gates < 1 ||
      counts.channels != 1)
    throw std::invalid_argument("a capture's counts need the columns and rows of its grid, bins, and one channel");
  if (!(delta_t > 0)) throw std::invalid_argument("a capture's bins need a width");
}

/// Writes points, or normals, in tal's order: [columns, rows, 3].
void write_grid(Hdf5Writer& writer, const char* name, std::size_t columns, std::size_t rows,
                const std::vector<Vec3>& points) {
  std::vector<double> values;
  values.reserve(3 * points.size());
  for (std::size_t column = 0; column < columns; ++column) {
    for (std::size_t row = 0; row < rows; ++row) {
      const Vec3& point = points[row * columns + column];
      values.insert(values.end(), {point.x, point.y, point.z});
    }
  }
  writer.write(name, {columns, rows, 3}, values);
}

void write_geometry(Hdf5Writer& writer, const CaptureGeometry& geometry) {
  const std::size_t columns = static_cast<std::size_t>(geometry.columns),
                    rows = static_cast<std::size_t>(geometry.rows);
  const auto write_format = [&](const char* name) {
    writer.write_enumeration(name, {{"UNKNOWN", 0}, {"N_3", 1}, {"X_Y_3", 2}}, 2);
  };
  write_grid(writer, "sensor_grid_xyz", columns, rows, geometry.sensor);
  write_grid(writer, "sensor_grid_normals", columns, rows, geometry.sensor_normal);
  write_format("sensor_grid_format");
  if (geometry.confocal) {
    write_grid(writer, "laser_grid_xyz", columns, rows, geometry.sensor);
    write_grid(writer, "laser_grid_normals", columns, rows, geometry.sensor_normal);
  } else {
    write_grid(writer, "laser_grid_xyz", geometry.laser.size(), 1, geometry.laser);
    write_grid(writer, "laser_grid_normals", geometry.laser.size(), 1, geometry.laser_normal);
  }
  write_format("laser_grid_format");
  writer.write_bool("t_accounts_first_and_last_bounces", geometry.accounts_first_and_last);
  const auto write_point = [&](const char* name, const Vec3& point) {
    writer.write(name, {3}, {point.x, point.y, point.z});
  };
  write_point("laser_xyz", geometry.laser_origin);
  write_point("sensor_xyz", geometry.sensor_origin);
}

/// f(bin, count) for a pixel's bins in [begin, end) that can be other than zero.
template <class F>
void for_each_count(const GatedImage& counts, std::size_t pixel, std::size_t begin, std::size_t end, F&& f) {
  for (std::size_t bin = begin; bin < end; ++bin) f(bin, counts.data[pixel * counts.gates + bin]);
}
template <class F>
void for_each_count(const StoredImage& counts, std::size_t pixel, std::size_t begin, std::size_t end, F&& f) {
  counts.for_each(static_cast<int>(pixel), static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end), f);
}

template <class Image>
void write_counts(Hdf5Writer& writer, const Image& counts, const CaptureGeometry& geometry) {
  const std::size_t spots = static_cast<std::size_t>(geometry.spots()), bins = static_cast<std::size_t>(counts.gates);
  const Layout layout = layout_of({spots, 1}, geometry);
  Hdf5Shape shape{bins, layout.columns, layout.rows};
  if (spots > 1) shape.insert(shape.begin() + 1, {spots, 1});
  writer.create_floats("H", shape);
  const std::size_t most = std::clamp(kSlabValues / layout.size(), std::size_t{1}, bins);
  std::vector<float> slab(most * layout.size());
  for (std::size_t first = 0; first < bins; first += most) {
    const std::size_t count = std::min(most, bins - first);
    std::fill(slab.begin(), slab.end(), 0.0f);
    layout.for_each([&](std::size_t i, std::size_t pixel) {
      for_each_count(counts, pixel, first, first + count, [&](std::size_t bin, auto value) {
        slab[(bin - first) * layout.size() + i] = static_cast<float>(value);
      });
    });
    writer.write_slab("H", first, count, slab.data());
  }
}

GatedImage read_counts(const Hdf5Reader& reader, const CaptureGeometry& geometry) {
  const Hdf5Shape shape = reader.shape("H");
  const std::size_t behind = reader.shape("sensor_grid_xyz").size() - 1;
  const Layout layout =
      layout_of(Hdf5Shape(shape.begin() + 1, shape.end() - static_cast<std::ptrdiff_t>(behind)), geometry);
  const std::size_t bins = shape[0];
  if (bins < 1 || bins > static_cast<std::size_t>(std::numeric_limits<int>::max()))
    reader.fail(fmt::format("H has {} bins", bins));
  reader.require_stored("H");

  GatedImage counts(geometry.columns, geometry.rows * geometry.spots(), static_cast<int>(bins), 1);
  const std::size_t most = std::clamp(kSlabValues / layout.size(), std::size_t{1}, bins);
  std::vector<double> slab(most * layout.size());
  for (std::size_t first = 0; first < bins; first += most) {
    const std::size_t count = std::min(most, bins - first);
    reader.read_slab("H", first, count, slab.data());
    layout.for_each([&](std::size_t i, std::size_t pixel) {
      for (std::size_t bin = 0; bin < count; ++bin)
        counts.data[pixel * bins + first + bin] = slab[bin * layout.size() + i];
    });
  }
  return counts;
}

template <class Image>
void write_with(const std::string& file, const CaptureFile& capture, const Image& counts) {
  require_fit(capture.geometry, capture.delta_t, counts);
  use_hdf5([&] {
    constexpr std::size_t kHeaders = std::size_t{1} << 16;
    Hdf5Writer writer(sizeof(float) * counts.gates * counts.pixels() + kHeaders);
    write_counts(writer, counts, capture.geometry);
    // The names and numbers of tal's own enumerations.
    writer.write_enumeration("H_format",
                             {{"UNKNOWN", 0}, {"T_Sx_Sy", 1}, {"T_Lx_Ly_Sx_Sy", 2}, {"T_Si", 3}, {"T_Li_Si", 4}},
                             capture.geometry.spots() > 1 ? 2 : 1);
    write_geometry(writer, capture.geometry);
    writer.write_number("delta_t", capture.delta_t);
    writer.write_number("t_start", capture.t_start);
    writer.write_text("scene_info", "{original_format: isochron}");
    writer.save(file);
  });
}

}  // namespace

CaptureGeometry read_capture_geometry(const std::string& file) {
  CaptureGeometry geometry;
  use_hdf5([&] { geometry = read_geometry(Hdf5Reader(file)); });
  return geometry;
}

CaptureFile read_capture(const std::string& file) {
  CaptureFile capture;
  use_hdf5([&] {
    const Hdf5Reader reader(file);
    capture.delta_t = read_number(reader, "delta_t");
    if (!(capture.delta_t > 0)) reader.fail(fmt::format("delta_t is {}, not positive", capture.delta_t));
    if (reader.has_values("t_start")) {
      capture.t_start = read_number(reader, "t_start");
    } else {
      capture.assumed.push_back("t_start is missing: taken as 0, so that the first bin begins there");
    }
    if (!reader.has("H")) reader.fail("H is missing");
    capture.geometry = read_geometry(reader);
    capture.counts = read_counts(reader, capture.geometry);
  });
  return capture;
}

void write_capture(const std::string& file, const CaptureFile& capture, const StoredImage& counts) {
  write_with(file, capture, counts);
}
void write_capture(const std::string& file, const CaptureFile& capture) {
  write_with(file, capture, capture.counts);
}

}  // namespace isochron
