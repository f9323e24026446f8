// What a session tells of its parameters and of its images' coordinates.
#include <pybind11/numpy.h>

#include "app/python/session.h"

namespace py = pybind11;

namespace isochron {
namespace {

/// Of values, for people; empty where there is none, or the scene file's.
std::string unit_of(const ParameterSpec& spec, LengthUnit gates) {
  using enum ParameterType;
  switch (spec.type) {
    case translation:
    case vertices:
    case camera_translation:
      return "scene units";
    case rotation:
    case camera_rotation:
      return "degrees";
    case time_offset:
      return isochron::name(gates);
    default:
      return "";
  }
}

/// Of the array that a parameter's values are.
py::tuple shape_of(const ParameterSpec& spec, int count) {
  if (spec.type == ParameterType::vertices && spec.direction_kind == VertexDirection::free)
    return py::make_tuple(count / 3, 3);
  const bool is_array = spec.type == ParameterType::vertices || spec.per != Per::all || count > 1;
  return is_array ? py::make_tuple(count) : py::tuple();
}

/// [row, column, xyz] of one point for each pixel.
template <class PointOf>
py::array_t<double> points_of(const Camera& camera, PointOf&& point_of) {
  py::array_t<double> points(std::vector<py::ssize_t>{camera.height, camera.width, 3});
  for (int pixel = 0; pixel < camera.width * camera.height; ++pixel)
    for (int axis = 0; axis < 3; ++axis)
      points.mutable_at(pixel / camera.width, pixel % camera.width, axis) = point_of(pixel).p[axis];
  return points;
}

}  // namespace

py::list Session::parameters() const {
  const Parameters& parameters = problem_->parameters();
  const auto part = [](const std::vector<double>& all, const Parameters::Block& block) {
    return to_array(std::vector<double>(all.begin() + block.begin, all.begin() + block.begin + block.count));
  };
  py::list list;
  for (std::size_t i = 0; i < experiment_.parameters.size(); ++i) {
    const ParameterSpec& spec = experiment_.parameters[i];
    const Parameters::Block& block = parameters.blocks()[i];
    py::dict item;
    item["name"] = block.name;
    item["type"] = type_name(spec);
    item["unit"] = unit_of(spec, experiment_.gates.unit);
    item["scale"] = block.scale;
    item["shape"] = shape_of(spec, block.count);
    item["begin"] = block.begin;
    item["count"] = block.count;
    item["initial"] = part(parameters.initial(), block);
    item["target"] = part(parameters.target(), block);
    item["lower"] = part(parameters.lower(), block);
    item["upper"] = part(parameters.upper(), block);
    list.append(item);
  }
  return list;
}

py::tuple Session::shape() const {
  const GatedImage image = problem_->blank();
  return py::make_tuple(image.gates, image.height, image.width, image.channels);
}

py::dict Session::coordinates() const {
  const GateMarks marks = gate_marks(problem_->experiment().gates);
  py::dict result;
  result["centers"] = to_array(marks.numbers);
  result["unit"] = marks.unit;
  for (const auto& [name, text] : exr_notes(problem_->experiment().gates))
    if (name == "isochron.quantity") result["quantity"] = text;
  const Scene& scene = problem_->scene();
  result["points"] = py::none();
  result["spots"] = py::none();
  if (!scene.capture) return result;
  result["points"] = points_of(scene.camera, [&](int pixel) { return scene.capture->sensor_of(pixel); });
  result["spots"] = points_of(scene.camera, [&](int pixel) { return scene.capture->spot_of(pixel); });
  return result;
}

}  // namespace isochron
