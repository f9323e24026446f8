// How parameters are bound to a scene: what they change, their values and their bounds.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/base/constants.h"
#include "optim/experiment/choices.h"
#include "optim/problem/parameters.h"

namespace isochron {
namespace {

constexpr double kRadian = 180 / kPi;
constexpr double kLeastRelativeEmission = 1e-6;
constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

template <class Item>
std::string names_of(const std::vector<Item>& items) {
  std::string list;
  for (const Item& item : items) list += (list.empty() ? "" : ", ") + item.name;
  return list.empty() ? "none" : list;
}

/// The index, which is -1 where the scene has no such item: complains of the key that names it.
template <class Item>
int found(int index, const ParameterSpec& spec, const char* key, const std::string& name,
          const std::vector<Item>& items) {
  if (index < 0)
    spec.fail(key, fmt::format("there is no {} '{}' in the scene", key, name), "allowed: " + names_of(items));
  return index;
}

/// What counts as one unit of the parameter where the user does not say.
double default_scale(const ParameterSpec& spec) {
  using enum ParameterType;
  if (spec.type == rotation || spec.type == camera_rotation) return kRadian;
  if (spec.type == emission || spec.type == intensity || spec.type == gain)
    return *std::max_element(spec.initial.begin(), spec.initial.end());
  return 1;
}

}  // namespace

void make_room(Scene& scene, const std::vector<ParameterSpec>& specs) {
  for (const ParameterSpec& spec : specs) {
    for (const std::string& name : spec.shapes()) {
      const int changed = scene.find_shape(name);
      if (changed >= 0) scene.shapes[changed].hidden = true;
    }
    const int index = scene.find_shape(spec.shape);
    if (spec.per == Per::pixel) {
      if (!scene.capture)
        spec.fail("per", "the scene has a camera", fmt::format("only captures have a {} per pixel", type_name(spec)));
      const bool offset = spec.type == ParameterType::time_offset;
      (offset ? scene.detector.time_offset : scene.detector.background).assign(scene.capture->sensor.size(), 0.0);
    }
    if (spec.type != ParameterType::texture || index < 0) continue;
    Shape& shape = scene.shapes[index];
    if (shape.textured) spec.fail("shape", "another parameter sets the albedos of '" + shape.name + "' already");
    const Material& own = scene.materials[shape.material];
    if (own.find("albedo") < 0 || own.kind() != std::string("diffuse"))
      spec.fail("shape", fmt::format("the material of '{}' is {}", shape.name, own.kind()), "diffuse");
    Material white = own;
    white.name = shape.name + " (albedo by vertex)";
    white.set("albedo", 1.0);
    shape.material = static_cast<int>(scene.materials.size());
    scene.materials.push_back(std::move(white));
    shape.textured = true;
    scene.texture.resize(scene.positions.size(), 1.0);
  }
  // Materials that parameters change count for the shapes that are made of them.
  for (const ParameterSpec& spec : specs)
    for (Shape& shape : scene.shapes)
      shape.hidden |= spec.type == ParameterType::material && scene.materials[shape.material].name == spec.material;
}

void mark_hidden(Scene& scene, const Experiment& experiment) {
  if (experiment.hidden_shapes.empty()) return;
  for (Shape& shape : scene.shapes) shape.hidden = false;
  for (const std::string& name : experiment.hidden_shapes) {
    const int index = scene.find_shape(name);
    if (index < 0)
      experiment.estimator_keys.at("hidden_shapes")
          .fail(fmt::format("there is no shape '{}' in the scene", name), "allowed: " + names_of(scene.shapes));
    scene.shapes[index].hidden = true;
  }
}

Parameters::Parameters(const Scene& scene, const std::vector<ParameterSpec>& specs, double gate_unit)
    : scene_(scene), motions_(scene.shapes.size()), light_motions_(scene.lights.size()) {
  for (const ParameterSpec& spec : specs) {
    Unknowns unknowns;
    const int first = size();
    if (!bind_move(spec, first, unknowns)) bind_value(spec, first, gate_unit, unknowns);
    bind_values(spec, unknowns);
    const int count = unknowns.count;
    blocks_.push_back({spec.name, first, count, spec.scale > 0 ? spec.scale : default_scale(spec)});
    for (int i = 0; i < count; ++i)
      component_names_.push_back(count == 1 ? spec.name : fmt::format("{}[{}]", spec.name, i));
  }
}

int Parameters::find_shape(const ParameterSpec& spec) const {
  return find_shapes(spec)[0];
}

std::vector<int> Parameters::find_shapes(const ParameterSpec& spec) const {
  std::vector<int> indices;
  for (const std::string& name : spec.shapes())
    indices.push_back(found(scene_.find_shape(name), spec, "shape", name, scene_.shapes));
  return indices;
}

int Parameters::find_light(const ParameterSpec& spec) const {
  return found(scene_.find_light(spec.light), spec, "light", spec.light, scene_.lights);
}

void Parameters::bind_value(const ParameterSpec& spec, int first, double gate_unit, Unknowns& unknowns) {
  const DofLayout layout(scene_);
  Value value{0, 1, first, 1};
  const auto colour = [&](int dof) {
    value.dof = dof;
    value.numbers = 3;
    value.count = scene_.grey ? 1 : 3;
  };
  const auto add = [&] {
    for (const Value& other : values_)
      if (other.dof == value.dof)
        spec.fail("type", fmt::format("another parameter sets the same {} already", type_name(spec)));
    values_.push_back(value);
  };
  switch (spec.type) {
    case ParameterType::material: {
      const int material =
          found(scene_.find_material(spec.material), spec, "material", spec.material, scene_.materials);
      Quantity quantity{};
      const int number = scene_.materials[material].find(spec.quantity, &quantity);
      if (number < 0)
        spec.fail("material", fmt::format("material '{}' is {} and has no {}", spec.material,
                                          scene_.materials[material].kind(), spec.quantity));
      value.dof = layout.number(material, number);
      if (quantity.values.size() == 3) colour(value.dof);
      break;
    }
    case ParameterType::emission:
      for (const int shape : find_shapes(spec)) {
        colour(layout.emission(shape, 0));
        add();
      }
      unknowns.count = value.count;
      return;
    case ParameterType::intensity:
      colour(layout.light_intensity(find_light(spec), 0));
      break;
    case ParameterType::texture: {
      const Shape& shape = scene_.shapes[find_shape(spec)];
      value.dof = layout.texture(shape.first_vertex);
      value.numbers = value.count = shape.vertex_count;
      for (int number = 0; number < shape.file_vertex_count(); ++number)
        unknowns.listed.push_back(shape.vertex_of_file(number));
      break;
    }
    case ParameterType::background:
      value.dof = layout.background(0);
      value.numbers = layout.backgrounds;
      value.count = spec.per == Per::pixel ? layout.backgrounds : 1;
      break;
    case ParameterType::gain:
      value.dof = layout.gain();
      break;
    case ParameterType::time_offset:
      value.dof = layout.time_offset(0);
      value.numbers = layout.time_offsets;
      value.count = spec.per == Per::pixel ? layout.time_offsets : 1;
      value.factor = gate_unit;
      break;
    default:
      throw std::logic_error("no value: " + type_name(spec));
  }
  add();
  unknowns.count = value.count;
}

namespace {

/// Values in the order of the unknowns, of a list that may have one for each vertex of a file.
std::vector<double> in_order(const ParameterSpec& spec, const char* key, const std::vector<double>& values, int count,
                             const std::vector<int>& listed) {
  if (static_cast<int>(values.size()) == count) return values;
  if (values.size() != listed.size()) {
    const bool differ = !listed.empty() && static_cast<int>(listed.size()) != count;
    spec.fail(key, fmt::format("{} values are given", values.size()),
              count == 1 ? "1"
                         : fmt::format("1{} {}{}", differ ? "," : " or", count,
                                       differ ? fmt::format(" or {}", listed.size()) : ""));
  }
  std::vector<double> ordered(static_cast<std::size_t>(count), kUnknown);
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (listed[i] < 0) continue;
    double& place = ordered[static_cast<std::size_t>(listed[i])];
    if (!std::isnan(place) && place != values[i])
      spec.fail(key, fmt::format("two vertices at one position have the values {} and {}", place, values[i]),
                "one value");
    place = values[i];
  }
  return ordered;
}

}  // namespace

void Parameters::bind_values(const ParameterSpec& spec, const Unknowns& unknowns) {
  const auto expand = [&](const std::vector<double>& values, const char* key, double missing, auto& into) {
    if (values.size() < 2) {
      into.insert(into.end(), static_cast<std::size_t>(unknowns.count), values.empty() ? missing : values[0]);
      return;
    }
    const std::vector<double> ordered = in_order(spec, key, values, unknowns.count, unknowns.listed);
    into.insert(into.end(), ordered.begin(), ordered.end());
  };
  double lowest = -std::numeric_limits<double>::infinity(), highest = -lowest;
  const double largest = spec.initial.empty() ? 0 : *std::max_element(spec.initial.begin(), spec.initial.end());
  const auto within = [&](const Quantity::Range& range) {
    lowest = range.lowest;
    highest = range.highest;
  };
  switch (spec.type) {
    case ParameterType::material: {
      Quantity quantity{};
      scene_.materials[scene_.find_material(spec.material)].find(spec.quantity, &quantity);
      within(quantity.range(largest));
      break;
    }
    case ParameterType::texture:
      within(fraction_range(largest));
      break;
    case ParameterType::emission:
    case ParameterType::intensity:
    case ParameterType::gain:
      if (!(largest > 0)) spec.fail("initial", fmt::format("is no {}", type_name(spec)), "a number above 0");
      lowest = kLeastRelativeEmission * largest;
      break;
    case ParameterType::background:
      lowest = 0;
      break;
    default:
      break;
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

}  // namespace isochron
