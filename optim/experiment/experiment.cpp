#include "optim/experiment/experiment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "core/base/error.h"
#include "core/scene/scene_loader.h"
#include "optim/experiment/experiment_reader.h"

namespace isochron {
namespace {

constexpr int kMostSamples = 1 << 30;
constexpr int kMostBounces = 10000;

/// Names become file names and columns.
std::string file_name(const YamlValue& value) {
  const std::string name = value.text();
  const bool valid = name[0] != '-' && std::all_of(name.begin(), name.end(), [](unsigned char c) {
                       return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-';
                     });
  if (!valid) value.fail(quote(name) + " is not a usable name", "letters, digits, _ and -");
  return name;
}

/// A number, a list of numbers or the name of a text file of numbers.
std::vector<double> read_values(const YamlValue& value, InputFolder& folder) {
  if (value.is_number()) return {value.number()};
  if (value.is_map()) value.fail("is a map", "a number, a list of numbers or a text file");
  std::vector<double> values;
  if (value.is_list()) {
    values = value.numbers();
  } else {
    for (const auto& row : read_numbers(value, folder)) values.insert(values.end(), row.begin(), row.end());
  }
  if (values.empty()) value.fail("holds no number", "at least one");
  return values;
}

Selection read_selection(const YamlValue& value) {
  Selection selection;
  if (value.is_list()) {
    selection.kind = Selection::Kind::list;
    for (const YamlValue& entry : value.list())
      selection.indices.push_back(static_cast<int>(entry.integer(0, std::numeric_limits<int>::max())));
    return selection;
  }
  if (!value.is_map()) value.fail("is neither", "a list of vertex indices, or {box: {min, max}}");
  selection.kind = Selection::Kind::box;
  YamlMap map = value.map();
  YamlMap box = map.require("box").map();
  selection.min = box.require("min").vec3();
  selection.max = box.require("max").vec3();
  box.reject_unknown();
  map.reject_unknown();
  return selection;
}

/// [x, y, z], center, or {follow: [x, y, z]}.
void read_pivot(const YamlValue& value, ParameterSpec& spec) {
  if (value.is_list()) {
    spec.pivot = value.vec3();
  } else if (value.is_map()) {
    YamlMap map = value.map();
    spec.pivot_kind = PivotKind::follow;
    spec.pivot = map.require("follow").vec3();
    map.reject_unknown();
  } else {
    value.choice({"center"});
    spec.pivot_kind = PivotKind::center;
  }
}

/// A misplaced key gets its types named.
void explain_keys_of_other_types(ParameterType type, YamlMap& map) {
  const auto explain = [&](const char* key, const char* types) {
    map.explain(key, fmt::format("belongs to {}, not to {}", types, name(type)));
  };
  explain("shape", "translation, rotation, vertices and emission");
  explain("material", "albedo, roughness and ior");
  explain("selection", "translation, rotation and vertices");
  explain("direction", "translation and vertices");
  explain("axis", "rotation");
  explain("pivot", "rotation");
  explain("smoothing", "vertices");
}

ParameterSpec read_parameter(const YamlValue& value, InputFolder& folder, bool target_required) {
  YamlMap map = value.map();
  ParameterSpec spec;
  spec.where.emplace("", value);
  const auto find = [&](const char* key) {
    const auto found = map.find(key);
    if (found) spec.where.emplace(key, *found);
    return found;
  };
  const auto require = [&](const char* key) {
    const YamlValue found = map.require(key);
    spec.where.emplace(key, found);
    return found;
  };
  spec.name = file_name(require("name"));
  constexpr const char* kReserved[] = {"render", "target", "initial", "final"};
  if (std::find(std::begin(kReserved), std::end(kReserved), spec.name) != std::end(kReserved))
    spec.fail("name", fmt::format("'{}' is the name of another output", spec.name));
  spec.type = static_cast<ParameterType>(
      require("type").choice({"translation", "rotation", "vertices", "albedo", "roughness", "ior", "emission"}));
  const bool of_material = is_of_material(spec.type);
  (of_material ? spec.material : spec.shape) = require(of_material ? "material" : "shape").text();
  if (!of_material && spec.type != ParameterType::emission)
    if (const auto selection = find("selection")) spec.selection = read_selection(*selection);
  if (spec.type == ParameterType::translation) spec.direction = require("direction").direction();
  if (spec.type == ParameterType::rotation) {
    spec.axis = require("axis").direction();
    if (!std::isnormal(length_squared(spec.axis)))
      spec.fail("axis", "is too long or too short", "a length whose square a double can hold");
    if (const auto pivot = find("pivot")) read_pivot(*pivot, spec);
  }
  if (spec.type == ParameterType::vertices) {
    const YamlValue direction = require("direction");
    if (direction.is_list())
      spec.direction = direction.direction();
    else if (direction.is_scalar())
      spec.direction_kind = direction.choice({"normal", "free"}) == 0 ? VertexDirection::normal : VertexDirection::free;
    else
      direction.fail("is neither", "[x, y, z], normal or free");
  }
  if (spec.type == ParameterType::vertices) {
    if (const auto found = find("smoothing")) {
      YamlMap smoothing = found->map();
      if (const auto diffusion = smoothing.find("diffusion"))
        spec.diffusion = diffusion->number(NumberRange::non_negative());
      if (const auto slopes = smoothing.find("slopes")) spec.slopes = slopes->number(NumberRange::non_negative());
      smoothing.reject_unknown();
    }
  }
  explain_keys_of_other_types(spec.type, map);
  spec.initial = read_values(require("initial"), folder);
  if (target_required)
    spec.target = read_values(require("target"), folder);
  else if (const auto target = find("target"))
    spec.target = read_values(*target, folder);
  if (const auto lower = find("lower")) spec.lower = read_values(*lower, folder);
  if (const auto upper = find("upper")) spec.upper = read_values(*upper, folder);
  if (const auto scale = find("scale")) spec.scale = scale->number(NumberRange::positive());
  map.reject_unknown();
  return spec;
}

void read_target(const YamlValue& value, const InputFolder& folder, TargetSpec& target) {
  YamlMap map = value.map();
  if (const auto images = map.find("images")) {
    target.images = existing_file(*images, folder);
  } else {
    if (const auto samples = map.find("samples")) target.samples = static_cast<int>(samples->integer(1, kMostSamples));
    if (const auto seed = map.find("seed"))
      target.seed = static_cast<std::uint64_t>(seed->integer(0, std::numeric_limits<long long>::max()));
    if (const auto bounces = map.find("max_bounces"))
      target.max_bounces = static_cast<int>(bounces->integer(0, kMostBounces));
    if (const auto value_of_noise = map.find("noise")) {
      YamlMap noise = value_of_noise->map();
      // So many that their noise, a millionth, no longer matters.
      target.photons = noise.require("photons").number({.low = 0, .high = 1e12, .low_open = true});
      noise.reject_unknown();
    }
  }
  map.reject_unknown();
}

LossSpec read_loss(const YamlValue& value) {
  YamlMap map = value.map();
  LossSpec loss;
  loss.kind = static_cast<LossKind>(map.require("kind").choice({"squared", "huber", "cauchy"}));
  if (loss.kind != LossKind::squared)
    if (const auto scale = map.find("scale")) loss.scale = scale->number(NumberRange::positive());
  map.explain("scale", "belongs to huber and cauchy, not to squared");
  map.reject_unknown();
  return loss;
}

OptimizerSpec read_optimizer(const YamlValue& value) {
  constexpr int kMostIterations = std::numeric_limits<int>::max() - 2;
  YamlMap map = value.map();
  OptimizerSpec optimizer;
  if (const auto method = map.find("method"))
    optimizer.method = static_cast<OptimizerMethod>(method->choice({"adam", "lbfgs", "levenberg_marquardt"}));
  if (const auto rate = map.find("learning_rate")) optimizer.learning_rate = rate->number(NumberRange::positive());
  if (const auto iterations = map.find("iterations"))
    optimizer.iterations = static_cast<int>(iterations->integer(0, kMostIterations));
  if (const auto tolerance = map.find("tolerance"))
    optimizer.tolerance = tolerance->number(NumberRange::non_negative());
  if (const auto stop_value = map.find("stop")) {
    YamlMap stop = stop_value->map();
    // Two losses are the least that have a standard error.
    optimizer.stop_window = static_cast<int>(stop.require("window").integer(2, 100000));
    stop.reject_unknown();
  }
  if (optimizer.method == OptimizerMethod::adam) {
    if (const auto decay_value = map.find("decay")) {
      YamlMap decay = decay_value->map();
      optimizer.decay.half_life = decay.require("half_life").number(NumberRange::positive());
      if (const auto start = decay.find("start"))
        optimizer.decay.start = static_cast<int>(start->integer(0, kMostIterations));
      decay.reject_unknown();
    }
  }
  if (optimizer.method == OptimizerMethod::lbfgs)
    if (const auto inner = map.find("inner_iterations"))
      optimizer.inner_iterations = static_cast<int>(inner->integer(1, 1000));
  map.explain("decay", fmt::format("belongs to adam, not to {}", name(optimizer.method)));
  map.explain("inner_iterations", fmt::format("belongs to lbfgs, not to {}", name(optimizer.method)));
  map.reject_unknown();
  return optimizer;
}

void read_settings(YamlMap& map, Experiment& experiment) {
  if (const auto value = map.find("samples")) {
    YamlMap samples = value->map();
    const auto count = [&](const char* key, int least, int& into) {
      if (const auto n = samples.find(key)) into = static_cast<int>(n->integer(least, kMostSamples));
    };
    count("primal", 1, experiment.samples.primal);
    count("interior", 0, experiment.samples.interior);
    count("visibility", 0, experiment.samples.visibility);
    count("path_length", 0, experiment.samples.path_length);
    samples.reject_unknown();
  }
  if (const auto value = map.find("estimator")) {
    YamlMap estimator = value->map();
    if (const auto sampling = estimator.find("sampling"))
      experiment.estimator.sampling = static_cast<Sampling>(sampling->choice({"auto", "standard", "ellipsoidal"}));
    if (const auto antithetic = estimator.find("antithetic")) experiment.estimator.antithetic = antithetic->boolean();
    if (const auto pick = estimator.find("pick"))
      experiment.estimator.pick = static_cast<ArcPick>(pick->choice({"contribution", "uniform"}));
    if (const auto numbers = estimator.find("numbers"))
      experiment.estimator.numbers = static_cast<Numbers>(numbers->choice({"low_discrepancy", "independent"}));
    if (const auto guiding = estimator.find("guiding")) experiment.guiding = guiding->boolean();
    if (const auto follow = estimator.find("follow"))
      experiment.estimator.follow = follow->number(NumberRange::non_negative());
    if (const auto radius = estimator.find("follow_radius"))
      experiment.estimator.follow_radius = radius->number(NumberRange::non_negative());
    estimator.reject_unknown();
  }
  if (const auto value = map.find("gradient")) {
    YamlMap gradient = value->map();
    if (const auto method = gradient.find("method"))
      experiment.gradient.method = static_cast<GradientMethod>(method->choice({"analytic", "finite_difference"}));
    if (const auto step = gradient.find("step")) {
      experiment.gradient.step = step->number(NumberRange::positive());
      experiment.gradient.step_given = true;
    }
    if (const auto common = gradient.find("common_numbers")) experiment.gradient.common_numbers = common->boolean();
    gradient.reject_unknown();
  }
  if (const auto value = map.find("loss")) experiment.loss = read_loss(*value);
  if (const auto value = map.find("optimizer")) experiment.optimizer = read_optimizer(*value);
  if (const auto value = map.find("output")) {
    YamlMap output = value->map();
    if (const auto geometry = output.find("geometry"))
      experiment.output.geometry = static_cast<GeometryFormat>(geometry->choice({"ply", "obj", "none"}));
    if (const auto every = output.find("every"))
      experiment.output.every = static_cast<int>(every->integer(0, std::numeric_limits<int>::max()));
    output.reject_unknown();
  }
  if (const auto seed = map.find("seed"))
    experiment.seed = static_cast<std::uint64_t>(seed->integer(0, std::numeric_limits<long long>::max()));
}

}  // namespace

ExrNotes exr_notes(const GateSpec& spec) {
  constexpr const char* kUnits[] = {"scene units", "ns", "ps"};
  const bool steady = spec.kind == GateKind::steady;
  return {{"isochron.gateCenters", steady ? "" : fmt::format("{}", fmt::join(spec.centers, " "))},
          {"isochron.gateUnit", kUnits[static_cast<int>(spec.unit)]},
          {"isochron.quantity", steady ? "radiance" : "radiance per scene unit of path length"}};
}

void ParameterSpec::fail(const std::string& key, const std::string& wrong, const std::string& allowed) const {
  for (const std::string& place : {key, std::string()})
    if (const auto found = where.find(place); found != where.end()) found->second.fail(wrong, allowed);
  throw InputError(
      fmt::format("parameter {}: {}: {}{}", name, key, wrong, allowed.empty() ? "" : " (" + allowed + ")"));
}

void SampleSpec::set_all(int n) {
  primal = n;
  for (int* count : {&interior, &visibility, &path_length})
    if (*count > 0) *count = n;
}

Experiment load_experiment(const std::string& file, const std::vector<std::string>& overrides) {
  const YamlValue root = open_yaml(file, overrides);
  YamlMap map = root.map();
  Experiment experiment;
  experiment.file = std::filesystem::absolute(file).string();
  InputFolder folder{std::filesystem::absolute(file).parent_path(), {}};
  experiment.name = file_name(map.require("name"));
  experiment.scene = existing_file(map.require("scene"), folder);
  if (const auto resolution = map.find("resolution")) experiment.resolution = read_resolution(*resolution);
  experiment.gates = read_gates(map.require("gates"), folder);
  if (const auto bounces = map.find("max_bounces"))
    experiment.estimator.max_bounces = static_cast<int>(bounces->integer(0, kMostBounces));
  experiment.target.max_bounces = experiment.estimator.max_bounces;
  if (const auto target = map.find("target")) read_target(*target, folder, experiment.target);
  if (const auto parameters = map.find("parameters")) {
    for (const YamlValue& entry : parameters->list()) {
      ParameterSpec spec = read_parameter(entry, folder, experiment.target.images.empty());
      for (const ParameterSpec& other : experiment.parameters)
        if (other.name == spec.name) spec.fail("name", fmt::format("'{}' stands here twice", spec.name));
      experiment.parameters.push_back(std::move(spec));
    }
  }
  read_settings(map, experiment);
  experiment.number_files = folder.number_files;
  for (const ParameterSpec& spec : experiment.parameters)
    if (spec.diffusion > 0 && experiment.optimizer.method != OptimizerMethod::adam)
      spec.fail("smoothing", "diffusion works with the method adam alone", "slopes for the other methods");
  if (const auto version = map.find("version")) version->text();
  map.reject_unknown();
  return experiment;
}

}  // namespace isochron
