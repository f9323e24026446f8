#include "app/python/back_projection.h"

#include <array>

#include "app/python/work.h"
#include "optim/reconstruct/first_surface.h"

namespace py = pybind11;

namespace isochron {
namespace {

std::vector<Vec3> to_points(const Array& array) {
  std::vector<Vec3> points(array.size() / 3);
  for (std::size_t i = 0; i < points.size(); ++i)
    points[i] = {array.data()[3 * i], array.data()[3 * i + 1], array.data()[3 * i + 2]};
  return points;
}

py::array array_of_points(const std::vector<Vec3>& points) {
  std::vector<double> values;
  for (const Vec3& p : points) values.insert(values.end(), {p.x, p.y, p.z});
  return to_array(std::move(values)).reshape({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}});
}

py::array to_volume(const BackProjection& found, const std::vector<float>& values) {
  return py::array_t<float>({found.depth.size(), found.up.size(), found.across.size()}, values.data());
}

py::array to_triangles(const Mesh& mesh) {
  py::array_t<int> triangles({mesh.faces.size(), std::size_t{3}});
  for (std::size_t i = 0; i < mesh.faces.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) triangles.mutable_at(i, k) = mesh.faces[i][k];
  }
  return triangles;
}

py::dict to_dict(BackProjection found, FirstSurface surface) {
  using namespace py::literals;
  const auto lines =
      std::array{static_cast<py::ssize_t>(found.up.size()), static_cast<py::ssize_t>(found.across.size())};
  const py::array albedo = to_volume(found, found.albedo), significance = to_volume(found, found.significance);
  return py::dict("albedo"_a = albedo, "significance"_a = significance, "least_albedo"_a = found.least_albedo,
                  "least_significance"_a = found.least_significance, "depth_resolution"_a = found.depth_resolution,
                  "lateral_resolution"_a = found.lateral_resolution,
                  "origin"_a = array_of_points({found.frame.origin}).reshape({3}),
                  "axes"_a = array_of_points({found.frame.across, found.frame.up, found.frame.normal}),
                  "across"_a = to_array(std::move(found.across)), "up"_a = to_array(std::move(found.up)),
                  "depth"_a = to_array(std::move(found.depth)),
                  "depth_map"_a = to_array(std::move(surface.depth)).reshape(lines),
                  "vertices"_a = array_of_points(surface.mesh.positions), "triangles"_a = to_triangles(surface.mesh),
                  "vertex_albedo"_a = to_array(std::move(surface.albedo)));
}

}  // namespace

py::dict back_project_arrays(const Array& counts, const Array& points, const Array& normals,
                             const std::optional<Array>& laser, double delta_t, double t_start,
                             const std::optional<Array>& origins,
                             const std::optional<std::pair<Array, Array>>& response, const std::optional<Array>& used,
                             double false_alarms) {
  CaptureFile capture;
  CaptureGeometry& geometry = capture.geometry;
  geometry.sensor = to_points(points);
  geometry.sensor_normal = to_points(normals);
  geometry.columns = static_cast<int>(geometry.sensor.size());
  geometry.rows = 1;
  geometry.confocal = !laser.has_value();
  if (laser) geometry.laser = to_points(*laser);
  geometry.accounts_first_and_last = origins.has_value();
  if (origins) {
    const std::vector<Vec3> places = to_points(*origins);
    geometry.laser_origin = places[0];
    geometry.sensor_origin = places[1];
  }
  capture.delta_t = delta_t;
  capture.t_start = t_start;
  capture.counts = GatedImage(geometry.columns, geometry.spots(), static_cast<int>(counts.shape(1)), 1);
  capture.counts.data = to_vector(counts);
  std::vector<std::uint8_t> mask;
  if (used) {
    for (const double value : to_vector(*used)) mask.push_back(value != 0);
  }
  DetectorResponse density;
  if (response) density = LinearDensity(to_vector(response->first), to_vector(response->second), "response");
  auto [found, surface] = run_work_for([&] {
    BackProjection volume = back_project(capture, density, mask, {.false_alarms = false_alarms});
    FirstSurface first = first_surface(volume);
    return std::pair(std::move(volume), std::move(first));
  });
  return to_dict(std::move(found), std::move(surface));
}

}  // namespace isochron
