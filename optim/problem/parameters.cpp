#include "optim/problem/parameters.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "optim/experiment/choices.h"

namespace isochron {
namespace {

constexpr double kRadian = 180 / kPi;
constexpr double kLeastRelativeEmission = 1e-6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

template <class Item>
std::string names_of(const std::vector<Item>& items) {
  std::string list;
  for (const Item& item : items) list += (list.empty() ? "" : ", ") + item.name;
  return list.empty() ? "none" : list;
}

std::string trimmed(const std::string& text) {
  const std::size_t first = text.find_first_not_of(" \t");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// Area-weighted sums of face normals at the vertices of a shape; zero where no face of positive area meets.
std::vector<Vec3> vertex_normals(const Scene& scene, const Shape& shape) {
  std::vector<Vec3> sum(shape.vertex_count);
  for (int t = shape.first_triangle; t < shape.first_triangle + shape.triangle_count; ++t) {
    const auto& v = scene.triangles[t].vertex;
    const Vec3& a = scene.positions[v[0]];
    const Vec3 area = cross(scene.positions[v[1]] - a, scene.positions[v[2]] - a);
    for (int k : v) sum[k - shape.first_vertex] += area;
  }
  return sum;
}

int select(const ParameterSpec& spec, const Scene& scene, const Shape& shape, std::vector<int>& slot) {
  const Selection& selection = spec.selection;
  slot.assign(shape.vertex_count, -1);
  int count = 0;
  if (selection.kind == Selection::Kind::list) {
    for (int v : selection.indices) {
      if (v < 0 || v >= shape.vertex_count)
        spec.fail("selection", fmt::format("there is no vertex {} in shape '{}'", v, shape.name),
                  fmt::format("0 to {}", shape.vertex_count - 1));
      if (slot[v] >= 0) spec.fail("selection", fmt::format("vertex {} is listed twice", v));
      slot[v] = count++;
    }
  } else {
    const Vec3 &lo = selection.min, &hi = selection.max;
    for (int v = 0; v < shape.vertex_count; ++v) {
      const Vec3& p = scene.positions[shape.first_vertex + v];
      const bool inside = selection.kind == Selection::Kind::all ||
                          (p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z && p.z <= hi.z);
      if (inside) slot[v] = count++;
    }
  }
  if (count == 0) spec.fail("selection", fmt::format("selects no vertex of shape '{}'", shape.name));
  return count;
}

/// What counts as one unit of the parameter where the user does not say.
double default_scale(const ParameterSpec& spec) {
  if (spec.type == ParameterType::rotation) return kRadian;
  if (spec.type == ParameterType::emission) return *std::max_element(spec.initial.begin(), spec.initial.end());
  return 1;
}

}  // namespace

Parameters::Parameters(const Scene& scene, const std::vector<ParameterSpec>& specs)
    : scene_(scene), motions_(scene.shapes.size()) {
  for (const ParameterSpec& spec : specs) {
    int count = 1;
    int shape = -1, material = -1;
    const bool of_material = spec.type == ParameterType::material;
    Quantity quantity{};
    int first_number = -1;
    if (of_material) {
      material = scene.find_material(spec.material);
      if (material < 0)
        spec.fail("material", fmt::format("there is no material '{}' in the scene", spec.material),
                  "allowed: " + names_of(scene.materials));
      first_number = scene.materials[material].find(spec.quantity, &quantity);
      if (first_number < 0)
        spec.fail("material", fmt::format("material '{}' is {} and has no {}", spec.material,
                                          scene.materials[material].kind(), spec.quantity));
    } else {
      shape = scene.find_shape(spec.shape);
      if (shape < 0)
        spec.fail("shape", fmt::format("there is no shape '{}' in the scene", spec.shape),
                  "allowed: " + names_of(scene.shapes));
    }
    const int first = size();
    if (spec.type == ParameterType::translation || spec.type == ParameterType::rotation ||
        spec.type == ParameterType::vertices) {
      Motion motion;
      motion.first_component = first;
      bind_motion(spec, motion, shape, count);
      motions_[shape].push_back(std::move(motion));
    } else {
      const int numbers = of_material ? static_cast<int>(quantity.values.size()) : 3;
      if (numbers == 3 && !scene.grey) count = 3;
      const DofLayout layout(scene);
      const int dof = of_material ? layout.number(material, first_number) : layout.emission(shape, 0);
      for (const Value& other : values_)
        if (other.dof == dof)
          spec.fail("type", fmt::format("another parameter sets the same {} already", type_name(spec)));
      values_.push_back({material, of_material ? first_number : shape, dof, numbers, first, count});
    }
    bind_values(spec, count, quantity);
    blocks_.push_back({spec.name, first, count, spec.scale > 0 ? spec.scale : default_scale(spec)});
    for (int i = 0; i < count; ++i)
      component_names_.push_back(count == 1 ? spec.name : fmt::format("{}[{}]", spec.name, i));
  }
}

void Parameters::bind_motion(const ParameterSpec& spec, Motion& motion, int shape_index, int& count) {
  const Shape& shape = scene_.shapes[shape_index];
  motion.type = spec.type;
  motion.direction_kind = spec.direction_kind;
  motion.direction = spec.type == ParameterType::rotation ? normalize(spec.axis) : spec.direction;
  const int selected = select(spec, scene_, shape, motion.slot);
  if (spec.type == ParameterType::rotation) bind_pivot(spec, motion, shape_index);
  if (spec.type != ParameterType::vertices) return;
  count = spec.direction_kind == VertexDirection::free ? 3 * selected : selected;
  if (spec.direction_kind != VertexDirection::normal) return;
  const std::vector<Vec3> sums = vertex_normals(scene_, shape);
  motion.normals.resize(selected);
  for (int v = 0; v < shape.vertex_count; ++v) {
    if (motion.slot[v] < 0) continue;
    const double norm = length(sums[v]);
    if (!(norm > 0))
      spec.fail("direction", fmt::format("vertex {} of shape '{}' has no normal", v, shape.name),
                "leave it out by selection");
    motion.normals[motion.slot[v]] = sums[v] / norm;
  }
}

void Parameters::bind_values(const ParameterSpec& spec, int count, const Quantity& quantity) {
  const auto expand = [&](const std::vector<double>& values, const char* key, double missing, auto& into) {
    if (values.size() > 1 && static_cast<int>(values.size()) != count)
      spec.fail(key, fmt::format("{} values are given", values.size()),
                count == 1 ? "1" : fmt::format("1 or {}", count));
    for (int i = 0; i < count; ++i)
      into.push_back(values.empty() ? missing : values.size() == 1 ? values[0] : values[i]);
  };
  double lowest = -kInfinity, highest = kInfinity;
  const double largest = spec.initial.empty() ? 0 : *std::max_element(spec.initial.begin(), spec.initial.end());
  if (spec.type == ParameterType::material) {
    const Quantity::Range range = quantity.range(largest);
    lowest = range.lowest;
    highest = range.highest;
  }
  if (spec.type == ParameterType::emission) {
    if (!(largest > 0)) spec.fail("initial", "is no emission", "a number above 0");
    lowest = kLeastRelativeEmission * largest;
  }
  const std::size_t first = initial_.size();
  expand(spec.initial, "initial", kUnknown, initial_);
  expand(spec.target, "target", kUnknown, target_);
  expand(spec.lower, "lower", lowest, lower_);
  expand(spec.upper, "upper", highest, upper_);
  for (std::size_t i = first; i < initial_.size(); ++i) {
    lower_[i] = std::max(lower_[i], lowest);
    upper_[i] = std::min(upper_[i], highest);
    if (!(lower_[i] < upper_[i]))
      spec.fail(spec.where.contains("lower") ? "lower" : "upper", "leaves no value to choose",
                fmt::format("lower below upper, within {} to {}", lowest, highest));
    const auto check = [&](double value, const char* key) {
      if (value < lower_[i] || value > upper_[i])
        spec.fail(key, fmt::format("{} is out of bounds", value), fmt::format("{} to {}", lower_[i], upper_[i]));
    };
    check(initial_[i], "initial");
    check(target_[i], "target");  // NaN, where unknown, passes
  }
}

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
    for (int i = 0; i < value.numbers; ++i) {
      const double t = theta[value.first_component + (value.count == 1 ? 0 : i)];
      if (value.material >= 0)
        scene.materials[value.material].set_number(value.index + i, t);
      else
        scene.shapes[value.index].emission.radiance[i] = t;
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
    if (s >= 0 && !motions_[s].empty()) move(s, v - scene_.shapes[s].first_vertex, centers[s], theta, &moved);
    for (int axis = 0; axis < 3; ++axis) {
      for (const Moved& entry : moved)
        if (entry.velocity[axis] != 0) basis.entries.push_back({entry.column, entry.velocity[axis]});
      end_row(layout.vertex(v, axis));
    }
  }
  std::vector<int> column_of(layout.size() - 3 * layout.vertices, -1);
  for (const Value& value : values_)
    for (int i = 0; i < value.numbers; ++i)
      column_of[value.dof + i - 3 * layout.vertices] = value.first_component + (value.count == 1 ? 0 : i);
  for (std::size_t i = 0; i < column_of.size(); ++i) {
    if (column_of[i] >= 0) basis.entries.push_back({column_of[i], 1.0});
    end_row(3 * layout.vertices + static_cast<int>(i));
  }
  return basis;
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
    char* stop = nullptr;
    const double value = std::strtod(number.c_str(), &stop);
    if (number.empty() || *stop != '\0' || !std::isfinite(value))
      throw InputError(fmt::format("--at {}: '{}' is not a finite number", key, number));
    int from = -1, count = 1;
    for (const Block& block : blocks_)
      if (block.name == key) from = block.begin, count = block.count;
    const auto component = std::find(component_names_.begin(), component_names_.end(), key);
    if (component != component_names_.end()) from = static_cast<int>(component - component_names_.begin());
    if (std::find(given.begin(), given.end(), key) != given.end())
      throw InputError(fmt::format("--at {}: is given twice", key));
    given.push_back(key);
    if (from < 0) throw InputError(fmt::format("--at {}: no such parameter; allowed: {}", key, names_of(blocks_)));
    for (int i = from; i < from + count; ++i) {
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
