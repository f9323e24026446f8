#include <fmt/format.h>

#include <filesystem>
#include <iterator>

#include "optim/experiment/experiment.h"
#include "optim/experiment/files.h"

namespace isochron {
namespace {

std::string quote(const std::string& text) {
  std::string quoted = "\"";
  for (char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

std::string list(const std::vector<double>& values) {
  return fmt::format("[{}]", fmt::join(values, ", "));
}

std::string number_or_list(const std::vector<double>& values) {
  return values.size() == 1 ? exact(values[0]) : list(values);
}

std::string vector(const Vec3& v) {
  return fmt::format("[{}, {}, {}]", v.x, v.y, v.z);
}

std::string gates_yaml(const GateSpec& gates) {
  constexpr const char* kKinds[] = {"steady", "gaussian", "boxcar", "truncated_gaussian", "tabulated"};
  constexpr const char* kUnits[] = {"scene", "ns", "ps"};
  std::string text = fmt::format("  kind: {}\n  unit: {}\n", kKinds[static_cast<int>(gates.kind)],
                                 kUnits[static_cast<int>(gates.unit)]);
  auto out = std::back_inserter(text);
  if (gates.scene_unit_m > 0) fmt::format_to(out, "  scene_unit_m: {}\n", gates.scene_unit_m);
  if (gates.kind != GateKind::steady) fmt::format_to(out, "  centers: {}\n", list(gates.centers));
  if (gates.sigma > 0) fmt::format_to(out, "  sigma: {}\n", gates.sigma);
  if (gates.width > 0) fmt::format_to(out, "  width: {}\n", gates.width);
  if (gates.half_width > 0) fmt::format_to(out, "  half_width: {}\n", gates.half_width);
  if (gates.kind == GateKind::tabulated)
    fmt::format_to(out, "  offsets: {}\n  values: {}\n", list(gates.offsets), list(gates.values));
  return text;
}

std::string parameter_yaml(const ParameterSpec& spec) {
  std::string text = fmt::format("  - name: {}\n    type: {}\n", quote(spec.name), name(spec.type));
  auto out = std::back_inserter(text);
  if (!spec.shape.empty()) fmt::format_to(out, "    shape: {}\n", quote(spec.shape));
  if (!spec.material.empty()) fmt::format_to(out, "    material: {}\n", quote(spec.material));
  const Selection& selection = spec.selection;
  if (selection.kind == Selection::Kind::list)
    fmt::format_to(out, "    selection: [{}]\n", fmt::join(selection.indices, ", "));
  if (selection.kind == Selection::Kind::box)
    fmt::format_to(out, "    selection: {{box: {{min: {}, max: {}}}}}\n", vector(selection.min), vector(selection.max));
  if (spec.type == ParameterType::rotation) {
    std::string pivot = vector(spec.pivot);
    if (spec.pivot_kind == PivotKind::center) pivot = "center";
    if (spec.pivot_kind == PivotKind::follow) pivot = "{follow: " + pivot + "}";
    fmt::format_to(out, "    axis: {}\n    pivot: {}\n", vector(spec.axis), pivot);
  }
  if (spec.direction_kind != VertexDirection::fixed)
    fmt::format_to(out, "    direction: {}\n", spec.direction_kind == VertexDirection::normal ? "normal" : "free");
  else if (spec.type == ParameterType::translation || spec.type == ParameterType::vertices)
    fmt::format_to(out, "    direction: {}\n", vector(spec.direction));
  if (spec.diffusion > 0 || spec.slopes > 0)
    fmt::format_to(out, "    smoothing: {{diffusion: {}, slopes: {}}}\n", spec.diffusion, spec.slopes);
  fmt::format_to(out, "    initial: {}\n", number_or_list(spec.initial));
  if (!spec.target.empty()) fmt::format_to(out, "    target: {}\n", number_or_list(spec.target));
  if (!spec.lower.empty()) fmt::format_to(out, "    lower: {}\n", number_or_list(spec.lower));
  if (!spec.upper.empty()) fmt::format_to(out, "    upper: {}\n", number_or_list(spec.upper));
  if (spec.scale > 0) fmt::format_to(out, "    scale: {}\n", spec.scale);
  return text;
}

}  // namespace

const char* program_version() {
  return ISOCHRON_VERSION;
}

const char* name(ParameterType type) {
  constexpr const char* kNames[] = {"translation", "rotation", "vertices", "albedo", "roughness", "ior", "emission"};
  return kNames[static_cast<int>(type)];
}

const char* name(OptimizerMethod method) {
  constexpr const char* kNames[] = {"adam", "lbfgs", "levenberg_marquardt"};
  return kNames[static_cast<int>(method)];
}

std::string resolved_yaml(const Experiment& e, const std::string& folder) {
  const std::filesystem::path base = std::filesystem::weakly_canonical(std::filesystem::absolute(folder));
  const auto relative = [&](const std::string& file) {
    return quote(std::filesystem::path(file).lexically_proximate(base).string());
  };
  constexpr const char* kSampling[] = {"auto", "standard", "ellipsoidal"};
  std::string text =
      fmt::format("version: {}\nname: {}\nscene: {}\nmax_bounces: {}\ngates:\n{}", quote(program_version()),
                  quote(e.name), relative(e.scene), e.estimator.max_bounces, gates_yaml(e.gates));
  auto out = std::back_inserter(text);
  if (e.resolution[0] > 0) fmt::format_to(out, "resolution: [{}, {}]\n", e.resolution[0], e.resolution[1]);
  text += e.parameters.empty() ? "parameters: []\n" : "parameters:\n";
  for (const ParameterSpec& spec : e.parameters) text += parameter_yaml(spec);
  if (e.target.images.empty())
    fmt::format_to(out, "target:\n  samples: {}\n  seed: {}\n  max_bounces: {}\n", e.target.samples, e.target.seed,
                   e.target.max_bounces);
  else
    fmt::format_to(out, "target:\n  images: {}\n", relative(e.target.images));
  if (e.target.photons > 0) fmt::format_to(out, "  noise: {{photons: {}}}\n", e.target.photons);
  fmt::format_to(out, "samples:\n  primal: {}\n  interior: {}\n  visibility: {}\n  path_length: {}\n", e.samples.primal,
                 e.samples.interior, e.samples.visibility, e.samples.path_length);
  constexpr const char* kPicks[] = {"contribution", "uniform"};
  constexpr const char* kNumbers[] = {"low_discrepancy", "independent"};
  fmt::format_to(out, "estimator:\n  sampling: {}\n  antithetic: {}\n  pick: {}\n  numbers: {}\n",
                 kSampling[static_cast<int>(e.estimator.sampling)], e.estimator.antithetic,
                 kPicks[static_cast<int>(e.estimator.pick)], kNumbers[static_cast<int>(e.estimator.numbers)]);
  fmt::format_to(out, "  guiding: {}\n  follow: {}\n  follow_radius: {}\n", e.guiding, e.estimator.follow,
                 e.estimator.follow_radius);
  const bool analytic = e.gradient.method == GradientMethod::analytic;
  fmt::format_to(out, "gradient:\n  method: {}\n", analytic ? "analytic" : "finite_difference");
  // A step that nobody chose stays out where it plays no part: the check command would take it for a wish.
  if (!analytic || e.gradient.step_given) fmt::format_to(out, "  step: {}\n", e.gradient.step);
  if (!e.gradient.common_numbers) fmt::format_to(out, "  common_numbers: false\n");
  constexpr const char* kLosses[] = {"squared", "huber", "cauchy"};
  fmt::format_to(out, "loss:\n  kind: {}\n", kLosses[static_cast<int>(e.loss.kind)]);
  if (e.loss.kind != LossKind::squared) fmt::format_to(out, "  scale: {}\n", e.loss.scale);
  const OptimizerSpec& optimizer = e.optimizer;
  fmt::format_to(out, "optimizer:\n  method: {}\n  learning_rate: {}\n  iterations: {}\n  tolerance: {}\n",
                 name(optimizer.method), optimizer.learning_rate, optimizer.iterations, optimizer.tolerance);
  if (optimizer.stop_window > 0) fmt::format_to(out, "  stop: {{window: {}}}\n", optimizer.stop_window);
  if (optimizer.decay.half_life > 0)
    fmt::format_to(out, "  decay: {{start: {}, half_life: {}}}\n", optimizer.decay.start, optimizer.decay.half_life);
  if (optimizer.method == OptimizerMethod::lbfgs)
    fmt::format_to(out, "  inner_iterations: {}\n", optimizer.inner_iterations);
  constexpr const char* kGeometry[] = {"ply", "obj", "none"};
  fmt::format_to(out, "output:\n  geometry: {}\n  every: {}\n", kGeometry[static_cast<int>(e.output.geometry)],
                 e.output.every);
  fmt::format_to(out, "seed: {}\n", e.seed);
  return text;
}

}  // namespace isochron
