#include "optim/problem/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "core/base/error.h"
#include "core/base/text_lines.h"

namespace isochron {
namespace {

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

Parameters::VertexField Parameters::vertex_field(const Block& block) const {
  for (std::size_t s = 0; s < motions_.size(); ++s)
    for (const Motion& motion : motions_[s]) {
      if (motion.type != ParameterType::vertices || motion.first_component != block.begin) continue;
      VertexField field{block.name, block.begin, motion.direction_kind == VertexDirection::free ? 3 : 1, 1, {}};
      if (motion.direction_kind == VertexDirection::fixed) field.unit = length(motion.direction);
      field.vertices.resize(block.count / field.stride);
      for (std::size_t v = 0; v < motion.slot.size(); ++v)
        if (motion.slot[v] >= 0) field.vertices[motion.slot[v]] = scene_.shapes[s].first_vertex + static_cast<int>(v);
      return field;
    }
  const DofLayout layout(scene_);
  for (const Value& value : values_)
    for (const Shape& shape : scene_.shapes) {
      if (!shape.textured || value.first_component != block.begin || value.dof != layout.texture(shape.first_vertex))
        continue;
      VertexField field{block.name, block.begin, 1, 1, std::vector<int>(shape.vertex_count)};
      std::iota(field.vertices.begin(), field.vertices.end(), shape.first_vertex);
      return field;
    }
  throw std::logic_error("not a parameter of vertices: " + block.name);
}

double Parameters::distance_to_target(const std::vector<double>& theta) const {
  double sum = 0;
  for (const Block& block : blocks_)
    for (int i = block.begin; i < block.begin + block.count; ++i) {
      const double error = (theta[i] - target_[i]) / block.scale;
      sum += error * error;
    }
  return std::sqrt(sum / static_cast<double>(theta.size()));
}

double Parameters::distance_to_target(const std::vector<double>& theta, const Block& block) const {
  double sum = 0;
  for (int i = block.begin; i < block.begin + block.count; ++i) {
    const double error = theta[i] - target_[i];
    sum += error * error;
  }
  return std::sqrt(sum / block.count);
}

std::vector<double> Parameters::scales() const {
  std::vector<double> all(initial_.size());
  for (const Block& block : blocks_) std::fill_n(all.begin() + block.begin, block.count, block.scale);
  return all;
}

bool Parameters::target_known() const {
  return std::none_of(target_.begin(), target_.end(), [](double value) { return std::isnan(value); });
}

std::vector<int> Parameters::moving_shapes() const {
  std::vector<int> shapes;
  for (std::size_t s = 0; s < motions_.size(); ++s)
    if (!motions_[s].empty()) shapes.push_back(static_cast<int>(s));
  return shapes;
}

Scene Parameters::apply(const std::vector<double>& theta) const {
  Scene scene = in_place(theta);
  if (camera_motions_.empty()) return scene;
  for (const Shape& shape : scene.shapes)
    for (int v = shape.first_vertex; v < shape.first_vertex + shape.vertex_count; ++v)
      view(theta, true, scene.positions[v], nullptr);
  return scene;
}

Scene Parameters::in_place(const std::vector<double>& theta) const {
  Scene scene = scene_;
  for (std::size_t s = 0; s < scene.shapes.size(); ++s) {
    if (motions_[s].empty()) continue;
    const Shape& shape = scene.shapes[s];
    const std::vector<CarriedPoint> centers = pivots(static_cast<int>(s), theta);
    for (int v = 0; v < shape.vertex_count; ++v)
      scene.positions[shape.first_vertex + v] = move(static_cast<int>(s), v, centers, theta, nullptr);
    for (const Motion& motion : motions_[s])
      scene.shapes[s].deforms |= motion.type == ParameterType::vertices ||
                                 std::find(motion.slot.begin(), motion.slot.end(), -1) != motion.slot.end();
  }
  for (const Value& value : values_)
    for (int i = 0; i < value.numbers; ++i)
      set_value(scene, value.dof + i, value.factor * theta[value.first_component + (value.count == 1 ? 0 : i)]);
  for (std::size_t i = 0; i < scene.lights.size(); ++i) {
    PointLight& light = scene.lights[i];
    move_light(static_cast<int>(i), theta, light.position, light.direction, nullptr, nullptr);
  }
  return scene;
}

TangentBasis Parameters::tangent(const std::vector<double>& theta) const {
  const DofLayout layout(scene_);
  TangentBasis basis;
  basis.columns = size();
  basis.row_begin.assign(layout.size() + 1, 0);
  // Rows come in the order of DofLayout: vertices shape by shape, then materials, then emissions.
  const auto end_row = [&](int dof) { basis.row_begin[dof + 1] = static_cast<int>(basis.entries.size()); };
  std::vector<int> shape_of(layout.vertices, -1);
  for (std::size_t s = 0; s < scene_.shapes.size(); ++s) {
    const Shape& shape = scene_.shapes[s];
    std::fill_n(shape_of.begin() + shape.first_vertex, shape.vertex_count, static_cast<int>(s));
  }
  std::vector<std::vector<CarriedPoint>> centers;
  for (std::size_t s = 0; s < scene_.shapes.size(); ++s) centers.push_back(pivots(static_cast<int>(s), theta));
  std::vector<Moved> moved;
  for (int v = 0; v < layout.vertices; ++v) {
    moved.clear();
    const int s = shape_of[v];
    if (s >= 0 && !(motions_[s].empty() && camera_motions_.empty())) {
      Vec3 p = move(s, v - scene_.shapes[s].first_vertex, centers[s], theta, &moved);
      view(theta, true, p, &moved);
      if (!camera_motions_.empty())
        std::sort(moved.begin(), moved.end(), [](const Moved& a, const Moved& b) { return a.column < b.column; });
    }
    for (int axis = 0; axis < 3; ++axis) {
      for (const Moved& entry : moved)  // in the listed order within shape and camera
        if (entry.velocity[axis] != 0) basis.entries.push_back({entry.column, entry.velocity[axis]});
      end_row(layout.vertex(v, axis));
    }
  }
  std::vector<std::vector<TangentBasis::Entry>> rates(layout.size() - 3 * layout.vertices);
  const auto rates_of = [&](int dof) -> auto& {
    return rates[dof - 3 * layout.vertices];
  };
  for (const Value& value : values_)
    for (int i = 0; i < value.numbers; ++i)
      rates_of(value.dof + i).push_back({value.first_component + (value.count == 1 ? 0 : i), value.factor});
  for (int i = 0; i < layout.lights; ++i) {
    Vec3 position, direction;
    std::vector<Moved> position_rate, direction_rate;
    move_light(i, theta, position, direction, &position_rate, &direction_rate);
    const auto add = [&](const std::vector<Moved>& all, int first_dof) {
      for (const Moved& entry : all)
        for (int axis = 0; axis < 3; ++axis)
          if (entry.velocity[axis] != 0) rates_of(first_dof + axis).push_back({entry.column, entry.velocity[axis]});
    };
    add(position_rate, layout.light_position(i, 0));
    add(direction_rate, layout.light_direction(i, 0));
  }
  for (std::size_t i = 0; i < rates.size(); ++i) {
    std::sort(rates[i].begin(), rates[i].end(), [](const auto& a, const auto& b) { return a.column < b.column; });
    basis.entries.insert(basis.entries.end(), rates[i].begin(), rates[i].end());
    end_row(3 * layout.vertices + static_cast<int>(i));
  }
  return basis;
}

Parameters::Block Parameters::find(const std::string& name, const char* option) const {
  std::string known;
  for (const Block& block : blocks_) {
    if (block.name == name) return block;
    known += (known.empty() ? "" : ", ") + block.name;
  }
  const auto component = std::find(component_names_.begin(), component_names_.end(), name);
  if (component == component_names_.end())
    throw InputError(fmt::format("{} {}: no such parameter; allowed: {}", option, name, known));
  return {name, static_cast<int>(component - component_names_.begin()), 1};
}

std::vector<double> Parameters::parse_point(const std::string& text) const {
  std::vector<double> theta = initial_;
  std::vector<std::string> given;
  std::size_t begin = 0;
  for (bool first = true; begin <= text.size(); first = false) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string item = trimmed(text.substr(begin, end - begin));
    begin = end + 1;
    if (first && item == "initial") continue;
    if (first && item == "target") {
      if (!target_known()) throw InputError("--at target: the experiment gives no target values for its parameters");
      theta = target_;
      continue;
    }
    const std::size_t equals = item.find('=');
    const std::string key = trimmed(item.substr(0, equals));
    if (equals == std::string::npos)
      throw InputError(fmt::format("--at {}: allowed: initial, target or NAME=VALUE[,NAME=VALUE...]", item));
    const std::string number = trimmed(item.substr(equals + 1));
    const std::optional<double> given_value = parse_number(number);
    if (!given_value) throw InputError(fmt::format("--at {}: '{}' is not a finite number", key, number));
    const double value = *given_value;
    const Block block = find(key, "--at");
    if (std::find(given.begin(), given.end(), key) != given.end())
      throw InputError(fmt::format("--at {}: is given twice", key));
    given.push_back(key);
    for (int i = block.begin; i < block.begin + block.count; ++i) {
      if (value < lower_[i] || value > upper_[i])
        throw InputError(
            fmt::format("--at {}: {} is out of bounds; allowed: {} to {}", key, value, lower_[i], upper_[i]));
      theta[i] = value;
    }
  }
  if (!coordinates_fit(apply(theta)))
    throw InputError(fmt::format("--at {}: puts a vertex too far away; allowed: coordinates of at most {}", text,
                                 kLargestCoordinate));
  return theta;
}

TangentBasis select_columns(const TangentBasis& basis, int first, int count) {
  TangentBasis selected;
  selected.columns = count;
  selected.row_begin.assign(basis.row_begin.size(), 0);
  for (std::size_t row = 0; row + 1 < basis.row_begin.size(); ++row) {
    for (int e = basis.row_begin[row]; e < basis.row_begin[row + 1]; ++e) {
      const TangentBasis::Entry& entry = basis.entries[e];
      if (entry.column >= first && entry.column < first + count)
        selected.entries.push_back({entry.column - first, entry.coefficient});
    }
    selected.row_begin[row + 1] = static_cast<int>(selected.entries.size());
  }
  return selected;
}

}  // namespace isochron
