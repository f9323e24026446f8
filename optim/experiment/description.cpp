#include "optim/experiment/description.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <set>

#include "core/base/error.h"
#include "core/base/ranks.h"
#include "core/scene/scene_loader.h"
#include "optim/experiment/choices.h"
#include "optim/experiment/number_file.h"
#include "optim/experiment/technique_names.h"

namespace isochron {
namespace {

constexpr int kMostSamples = 1 << 30;
constexpr int kMostBounces = 10000;
std::string existing_file(const YamlValue& value, const std::filesystem::path& folder) {
  const std::string text = value.text();
  const std::string found = from_first_rank([&] {
    std::error_code none;  // such as of names that are too long
    const std::filesystem::path path = std::filesystem::weakly_canonical(folder / text, none);
    return none || !std::filesystem::is_regular_file(path, none) ? "" : path.string();
  });
  if (found.empty()) value.fail("there is no file " + quote(text), "a path relative to the experiment file");
  return found;
}

/// The scene loader's, whose messages here name both numbers and their range.
Field resolution(std::array<int, 2>& size) {
  Field field = resolution_field(size[0], size[1]);
  const std::string allowed = fmt::format("{}, {}", field.type, field.allowed);
  field.read = [read = field.read, allowed](const YamlValue& value) {
    if (!value.is_list()) value.fail("is not a list", allowed);
    const auto count = value.list().size();
    if (count != 2) value.fail(fmt::format("a list of {}", count), allowed);
    read(value);
  };
  return field;
}

/// [start, stop], the second the larger.
Field interval(std::array<double, 2>& ends) {
  return {"list of 2 numbers", "start below stop",
          [&ends](const YamlValue& value) {
            const std::vector<double> numbers = value.numbers();
            if (numbers.size() != 2 || !(numbers[0] < numbers[1]))
              value.fail("is not an interval", "[start, stop], start below stop");
            ends = {numbers[0], numbers[1]};
          },
          [&ends] {
            return yaml_list({ends[0], ends[1]});
          }};
}

void describe(Keys& keys, TargetSpec& target, const ExperimentFolder& folder) {
  keys.value("images", folder.file(target.images),
             "EXR file of measured images, one channel or three per gate; without it the target is rendered",
             {.unset = target.images.empty()});
  keys.value("capture", folder.file(target.capture),
             "HDF5 file of a measurement's counts (layout: FILES.md). Gates of kind `bins` take its bins, or combine "
             "some of them",
             {.only = {target.images.empty(), "targets without images", "images"}, .unset = target.capture.empty()});
  const Only rendered{!target.measured(), "rendered targets", target.images.empty() ? "a capture" : "images"};
  keys.value("samples", field::integer(target.samples, 1, kMostSamples), "per pixel", {.only = rendered});
  keys.value("seed", field::seed(target.seed), "of its random numbers", {.only = rendered});
  keys.value("max_bounces", field::integer(target.max_bounces, 0, kMostBounces), "of its light",
             {.only = rendered, .otherwise = "the experiment's"});
  const auto noise = [&](Keys& inner) {
    // So many that their noise, a millionth, no longer matters.
    inner.value("photons", field::number(target.photons, {.low = 0, .high = 1e12, .low_open = true}),
                "mean count of a pixel and colour in the brightest gate", {.unset = target.photons == 0});
    inner.value("counts", field::boolean(target.counts),
                "the images are expected counts; each value becomes a Poisson number of that mean");
    inner.check([&](const YamlValue& value) {
      if ((target.photons > 0) == target.counts) value.fail("has to say how many", "photons: N, or counts: true");
    });
  };
  keys.map("noise", noise, "Poisson noise of the rendered target",
           {.only = rendered, .unset = target.photons == 0 && !target.counts});
  keys.value("window", interval(target.window),
             "only gates whose centre lies within are used; other bins of a capture are not rendered",
             {.unit = "scene units", .unset = !target.windowed(), .otherwise = "all are"});
  keys.value("mask", folder.file(target.mask),
             "NumPy array (.npy) [columns, rows] of the pixels; pixels with a zero are not used",
             {.unset = target.mask.empty(), .otherwise = "all are"});
  keys.value("histograms", field::integer(target.histograms, 0, std::numeric_limits<int>::max()),
             "of a capture: so many are used, spread evenly over it, and others are not rendered, which saves time; "
             "adam takes others in each iteration; 0: all are",
             {.unset = target.histograms == 0});
}

void describe(Keys& keys, SampleSpec& s) {
  keys.value("primal", field::integer(s.primal, 1, kMostSamples), "the images, for the loss");
  keys.value("interior", field::integer(s.interior, 0, kMostSamples),
             "interior term of the derivative: changes along paths whose visibility stays, the gates' slopes included; "
             "0: left out");
  keys.value(
      "visibility", field::integer(s.visibility, 0, kMostSamples),
      "visibility term: moving silhouettes and shadow boundaries; a sample is one attempt to find one; 0: left out");
  keys.value("path_length", field::integer(s.path_length, 0, kMostSamples),
             "gate-edge (path-length) boundary term: jumps of the gates; gaussian gates have none. 0: left out, but if "
             "gates jump "
             "`run` takes as many as of `interior`");
}

Field optional_number(std::optional<double>& number, const NumberRange& range) {
  return {"number", range.describe(), [&number, range](const YamlValue& value) { number = value.number(range); },
          [&number] { return fmt::format("{}", *number); }};
}

Field keep_length(std::optional<bool>& keep) {
  return {"`true` or `false`", "", [&keep](const YamlValue& value) { keep = value.boolean(); },
          [&keep] { return *keep ? "true" : "false"; }};
}

void describe_estimator(Keys& keys, Experiment& e) {
  EstimatorOptions& options = e.estimator;
  keys.remember(e.estimator_keys);
  keys.value("sampling", field::choice(options.sampling), "how paths are found");
  keys.value("antithetic", field::boolean(options.antithetic),
             "coupled pairs for the gates' slopes, under ellipsoidal sampling");
  keys.value("pick", field::choice(options.pick), "which arc of an ellipsoid a connection takes");
  keys.value("numbers", field::choice(options.numbers), "the random numbers of a pixel's samples");
  keys.value("hidden", optional_number(options.hidden, {.low = 0, .high = 1, .high_open = true}),
             "area sampling, for standard sampling: the probability that a step is drawn on `hidden_shapes`, until the "
             "path has met "
             "one. For derivatives, and for the first step from a capture's wall in images",
             {.unset = !options.hidden,
              .otherwise = "cameras `0`; captures `0.5`, derivatives `0.75`, or all where that is better"});
  keys.value(
      "hidden_shapes", field::names(e.hidden_shapes),
      "the area-sampled shapes: path vertices are drawn on them by area",
      {.unset = e.hidden_shapes.empty(), .otherwise = "those that parameters change; captures: all if there are none"});
  keys.value("keep_length", keep_length(options.keep_length),
             "emitters' points move so that paths keep their lengths: derivatives do not act on gates, which may be as "
             "narrow as "
             "Dirac's. Not for captures, lights without an extent or glass",
             {.unset = !options.keep_length, .otherwise = "where gates are narrower than 2 % of the smallest emitter"});
  keys.value("light", optional_number(options.light, {.low = 0, .high = 1, .high_open = true}),
             "the part of the samples (but for ellipsoidal connections) with light subpaths: walks from the emitters, "
             "joined with the "
             "paths from the camera. For light that leaves its case by a slit. Not of captures",
             {.unset = !options.light, .otherwise = "`auto`: `0.5` or `0`, as measured; else `0`"});
  keys.value("techniques", techniques(options),
             "which techniques may be used, to measure what each brings. Of the visibility term's the mean does not "
             "depend on them, but "
             "under Dirac gates",
             {.unset = !leaves_out_techniques(options), .otherwise = "all"});
  keys.value("guiding", field::boolean(e.guiding),
             "visibility: learn where boundaries matter from a small part of the samples");
  keys.value("follow", field::non_negative(options.follow),
             "contact-aware reparameterisation, needed where objects touch: distance within which path vertices follow "
             "what moves "
             "close to them; 0: not at all",
             {.unit = "radii of the smaller body"});
  keys.value("follow_radius", field::non_negative(options.follow_radius),
             "the same for the points that the camera sees", {.unit = "widths of a pixel"});
}

void describe(Keys& keys, GradientSpec& gradient) {
  keys.value("method", field::choice(gradient.method), "how the loss is differentiated");
  // A default step is not written where it has no effect: the check command would take it for a given one.
  const bool idle = gradient.method == GradientMethod::analytic && !gradient.step_given;
  if (keys.value("step", field::positive(gradient.step), "finite differences: half the distance of the two images",
                 {.unit = "the parameter's", .unset = idle, .otherwise = fmt::format("`{}`", gradient.step)}))
    gradient.step_given = true;
  keys.value("common_numbers", field::boolean(gradient.common_numbers),
             "finite differences: both images take the same random numbers, so that most of their noise cancels");
}

void describe(Keys& keys, LossSpec& loss) {
  keys.value("kind", field::choice(loss.kind), "how a pixel's residual counts", {.required = true});
  keys.value("scale", field::positive(loss.scale), "residuals beyond it count for less",
             {.only = only(loss.kind, {LossKind::huber, LossKind::cauchy}),
              .unit = "RMS of a typical pixel of the target (the median over lit pixels)"});
}

/// Levels carry the shape's offsets over into a new mesh, which leaves no place for what refers to the old one.
void check_remesh(const ParameterSpec& remeshed, const std::vector<ParameterSpec>& all) {
  if (remeshed.selection.kind != Selection::Kind::all)
    remeshed.fail("selection", "is of vertices that remeshing replaces", "leave it out");
  const auto is_albedo = [&](const ParameterSpec& other) {
    return other.type == ParameterType::texture && other.shape == remeshed.shape;
  };
  if (remeshed.remesh.outline > 0 && std::none_of(all.begin(), all.end(), is_albedo))
    remeshed.fail("remesh", fmt::format("outline: '{}' has no albedos by vertex", remeshed.shape),
                  "a parameter of type albedo with `per: vertex`");
  for (const ParameterSpec& other : all) {
    if (&other == &remeshed) continue;
    if (other.remesh.levels > 0) other.fail("remesh", "another parameter has it already", "one of them");
    const bool turns = other.type == ParameterType::rotation || other.type == ParameterType::vertices ||
                       other.selection.kind != Selection::Kind::all;
    const std::vector<std::string> shapes = other.shapes();
    if (turns && std::find(shapes.begin(), shapes.end(), remeshed.shape) != shapes.end())
      other.fail("shape", fmt::format("'{}' is remeshed by '{}'", remeshed.shape, remeshed.name),
                 "translations of the whole shape beside it");
  }
}

void check_parameters(const Experiment& experiment) {
  std::set<std::string> names;
  for (const ParameterSpec& spec : experiment.parameters) {
    if (!names.insert(spec.name).second) spec.fail("name", fmt::format("'{}' is given twice", spec.name));
    if (spec.diffusion > 0 && experiment.optimizer.method != OptimizerMethod::adam)
      spec.fail("smoothing", "diffusion works only with the method adam", "slopes for the other methods");
    if (spec.remesh.levels > 0) check_remesh(spec, experiment.parameters);
  }
}

/// The value that the file has at a path of keys; else the innermost map on the way that it has.
YamlValue found_at(YamlValue value, const std::vector<std::string>& path) {
  for (const std::string& key : path) {
    const auto inner = value.map().find(key);
    if (!inner) break;
    value = *inner;
  }
  return value;
}

/// What gates ask of the rest of the experiment.
void check_use_of_gates(const Experiment& experiment, const YamlValue& root) {
  const GateSpec& gates = experiment.gates;
  if (!experiment.target.capture.empty() && gates.kind != "bins")
    found_at(root, {"target", "capture"}).fail("a capture has bins", "gates of kind bins");
  if (gates.needs_bins() && experiment.target.capture.empty())
    found_at(root, {"gates"}).fail("start, width and count are missing", "required without a target's file of bins");
  if (gates.kind != "modulated") return;
  if (experiment.estimator.sampling == Sampling::ellipsoidal)
    found_at(root, {"estimator", "sampling"})
        .fail("modulated gates let light of every length through, so that no lengths can be drawn",
              "allowed: auto, standard");
  if (experiment.target.photons > 0)
    found_at(root, {"target", "noise"}).fail("readings under modulated gates may be negative, which no count is");
}

}  // namespace

Field ExperimentFolder::file(std::string& variable) const {
  return {"file", "relative to the experiment file",
          [this, &variable](const YamlValue& value) { variable = existing_file(value, path); },
          [this, &variable] { return yaml_text(std::filesystem::path(variable).lexically_proximate(path).string()); }};
}

Field ExperimentFolder::values(std::vector<double>& variable) {
  const auto read = [this, &variable](const YamlValue& value) {
    variable.clear();
    if (value.is_map()) value.fail("is a map", "a number, a list of numbers or a file of numbers");
    if (value.is_number())
      variable = {value.number()};
    else if (value.is_list())
      variable = value.numbers();
    else
      for (const auto& row : read_numbers(value)) variable.insert(variable.end(), row.begin(), row.end());
    if (variable.empty()) value.fail("holds no number", "at least one");
  };
  return {"number, list or file of numbers", "one for all, or one for each component", read,
          [&variable] { return variable.size() == 1 ? fmt::format("{}", variable[0]) : yaml_list(variable); }};
}

std::vector<std::vector<double>> ExperimentFolder::read_numbers(const YamlValue& value,
                                                                const std::vector<std::string>& columns) {
  number_files.push_back(existing_file(value, path));
  return read_number_file(number_files.back(), columns);
}

Field file_name(std::string& variable) {
  Field name = field::checked(field::text(variable), [&variable](const YamlValue& value) {
    const bool valid = variable[0] != '-' && std::all_of(variable.begin(), variable.end(), [](unsigned char c) {
                         return (c < 0x80 && std::isalnum(c)) || c == '_' || c == '-';
                       });
    if (!valid) value.fail(quote(variable) + " is not a usable name", "letters, digits, _ and -");
  });
  name.allowed = "letters, digits, `_` and `-`";
  return name;
}

void describe(Keys& keys, Experiment& e, ExperimentFolder& folder, bool target_values) {
  keys.value("name", file_name(e.name), "names the default output folder, `runs/NAME`", {.required = true});
  keys.value("scene", folder.file(e.scene), "the scene", {.required = true});
  keys.value("resolution", resolution(e.resolution),
             "in place of the scene's; the field of view stays across the width",
             {.unit = "pixels", .unset = e.resolution[0] == 0, .otherwise = "the camera's"});
  keys.map("gates", [&](Keys& inner) { describe(inner, e.gates, folder); }, "when the camera sees", {.required = true});
  keys.value("max_bounces", field::integer(e.estimator.max_bounces, 0, kMostBounces),
             "scattering vertices on a path, at most");
  keys.map(
      "target", [&](Keys& inner) { describe(inner, e.target, folder); }, "the images to be matched");
  keys.list(
      "parameters", e.parameters,
      [&](Keys& inner, ParameterSpec& spec) { describe(inner, spec, folder, target_values && !e.target.measured()); },
      "the unknowns; those of one shape act in this order", {.otherwise = "none"});
  keys.map(
      "samples", [&](Keys& inner) { describe(inner, e.samples); }, "per pixel and iteration");
  keys.map(
      "estimator", [&](Keys& inner) { describe_estimator(inner, e); }, "how images and derivatives are sampled");
  keys.map(
      "gradient", [&](Keys& inner) { describe(inner, e.gradient); }, "how the loss is differentiated");
  keys.map(
      "loss", [&](Keys& inner) { describe(inner, e.loss); }, "what is minimised");
  keys.map(
      "optimizer", [&](Keys& inner) { describe(inner, e.optimizer); }, "how it is minimised");
  keys.map(
      "output", [&](Keys& inner) { describe(inner, e.output); }, "what a run writes besides images and tables");
  keys.value("seed", field::seed(e.seed), "of the random numbers");
  std::string version;
  keys.value("version", field::text(version), "of the program, in the `experiment.yaml` of a run; without effect",
             {.unset = true});
  keys.check([&](const YamlValue& root) {
    check_parameters(e);
    check_use_of_gates(e, root);
  });
}

}  // namespace isochron
