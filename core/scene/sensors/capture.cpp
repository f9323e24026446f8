#include "core/scene/sensors/capture.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <string>

#include "core/base/error.h"
#include "core/image/capture_file.h"
#include "core/scene/coordinates.h"
#include "core/scene/sensors/pinhole.h"

namespace isochron {
namespace {

constexpr std::size_t kMostPoints = std::size_t{1} << 24;

Field points(std::vector<Vec3>& variable) {
  const auto read = [&variable](const YamlValue& value) {
    variable.clear();
    for (const YamlValue& entry : value.list()) {
      variable.push_back(entry.vec3());
      if (!coordinates_fit(variable.back()))
        entry.fail("lies too far away", fmt::format("coordinates of at most {}", kLargestCoordinate));
    }
    if (variable.empty()) value.fail("holds no point", "at least one [x, y, z]");
    if (variable.size() > kMostPoints) value.fail("holds too many points", fmt::format("at most {}", kMostPoints));
  };
  const auto write = [&variable] {
    std::string text;
    for (const Vec3& p : variable) text += (text.empty() ? "" : ", ") + yaml_vector(p);
    return "[" + text + "]";
  };
  return {"list of [x, y, z]", "at least one", read, write};
}

/// The sensor's keys: a grid, or points.
struct SensorKeys {
  Vec3 corner, across, down;
  int columns = 0, rows = 0;
  std::vector<Vec3> points;

  void describe(Keys& keys) {
    const bool listed = keys.value("points", isochron::points(points), "any points, in place of a grid",
                                   {.unit = "scene units", .unset = true});
    const Only grid{!listed, "grids", "points"};
    keys.value("corner", field::vec3(corner), "the first point of the first row",
               {.required = true, .only = grid, .unit = "scene units"});
    keys.value("across", field::direction(across), "from the first point of a row to the last",
               {.required = true, .only = grid, .unit = "scene units"});
    keys.value("down", field::direction(down), "from the first row to the last",
               {.required = true, .only = grid, .unit = "scene units"});
    keys.value("size", resolution_field(columns, rows), "columns and rows, corners included",
               {.required = true, .only = grid, .unit = "points"});
    keys.check([this](const YamlValue& value) { place(value); });
  }

  void place(const YamlValue& value) {
    if (!points.empty()) {
      columns = static_cast<int>(points.size());
      rows = 1;
      return;
    }
    if (static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) > kMostPoints)
      value.fail("has too many points", fmt::format("at most {}", kMostPoints));
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column)
        points.push_back(corner + across * (columns > 1 ? column / (columns - 1.0) : 0) +
                         down * (rows > 1 ? row / (rows - 1.0) : 0));
    for (const Vec3& p : {points.front(), points.back()})
      if (!coordinates_fit(p))
        value.fail("puts a point too far away", fmt::format("coordinates of at most {}", kLargestCoordinate));
  }
};

/// `confocal`, or {points}.
Field laser(std::vector<Vec3>& spots) {
  const auto read = [&spots](const YamlValue& value) {
    if (value.is_map()) {
      read_keys(value, [&](Keys& keys) { keys.value("points", points(spots), "", {.required = true}); });
      return;
    }
    value.choice({"confocal"});
    spots.clear();
  };
  const auto write = [&spots]() -> std::string {
    return spots.empty() ? "confocal" : "{points: " + points(spots).write() + "}";
  };
  return {
      "word or {points: [[x, y, z], ...]}", "`confocal`", read, write,
      "`confocal`: the laser lights the point that is looked at; `points`: every sensor point is seen with every spot"};
}

std::vector<WallPoint> wall_points(const std::vector<Vec3>& points, const std::vector<Vec3>& normals) {
  std::vector<WallPoint> result;
  for (std::size_t i = 0; i < points.size(); ++i) result.push_back({points[i], normals[i]});
  return result;
}

/// The geometry that the measurement's file holds, a metre being a scene unit.
Capture read_capture_of(const std::string& file) {
  const CaptureGeometry g = read_capture_geometry(file);
  Capture capture;
  capture.file = file;
  capture.assumed = g.assumed;
  capture.columns = g.columns;
  capture.rows = g.rows;
  capture.sensor = wall_points(g.sensor, g.sensor_normal);
  capture.spots = wall_points(g.laser, g.laser_normal);
  if (g.accounts_first_and_last) capture.origin = {g.laser_origin, g.sensor_origin};
  return capture;
}

}  // namespace

void describe(Keys& keys, Capture& capture) {
  SensorKeys sensor;
  std::vector<Vec3> spots;
  Vec3 normal{0, 0, 1};
  Capture::Origin origin;
  Keys::Places places;
  keys.remember(places);
  const auto read_file = [&capture](const YamlValue& value) {
    const std::string file =
        (std::filesystem::path(value.file()).parent_path() / value.text()).lexically_normal().string();
    try {
      capture = read_capture_of(file);
    } catch (const InputError& error) {
      value.fail(error.what());
    }
  };
  const bool from_file = keys.value(
      "file", {"file", "relative to the scene file", read_file, [&] { return yaml_text(capture.file); }},
      "HDF5 file of a measurement whose geometry is taken, in metres; in place of all other keys", {.unset = true});
  const Only in_place{!from_file, "captures without a file", "`file`"};
  keys.map("sensor", [&](Keys& inner) { sensor.describe(inner); }, "the points of the wall that are looked at",
           {.required = true, .only = in_place});
  keys.value("normal", unit_direction(normal), "of the wall, towards the hidden scene",
             {.required = true, .only = in_place});
  keys.value("laser", laser(spots), "where the wall is lit", {.only = in_place});
  const auto stands = [&](Keys& inner) {
    inner.value("laser", field::vec3(origin.laser), "where the laser stands",
                {.required = true, .unit = "scene units"});
    inner.value("sensor", field::vec3(origin.sensor), "where the detector stands",
                {.required = true, .unit = "scene units"});
  };
  keys.map("origin", stands,
           "if given, path lengths include the ways from the laser to the wall and from the wall to the detector",
           {.only = in_place, .otherwise = "paths begin and end at the wall"});
  keys.check([&](const YamlValue& value) {
    if (!capture.file.empty()) return;
    if (static_cast<double>(sensor.points.size()) * static_cast<double>(std::max<std::size_t>(1, spots.size())) >
        static_cast<double>(kMostPoints))
      value.fail("has too many pairs of sensor points and spots", fmt::format("at most {}", kMostPoints));
    capture.columns = sensor.columns;
    capture.rows = sensor.rows;
    const auto facing_normal = [&normal](const std::vector<Vec3>& points) {
      return wall_points(points, std::vector<Vec3>(points.size(), normal));
    };
    capture.sensor = facing_normal(sensor.points);
    capture.spots = facing_normal(spots);
    if (places.contains("origin")) capture.origin = origin;
  });
}

}  // namespace isochron
