#include "optim/run/levels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/constants.h"
#include "core/base/error.h"
#include "core/base/progress.h"
#include "core/base/ranks.h"
#include "core/base/yaml_reader.h"
#include "core/scene/mesh_writer.h"
#include "core/scene/scene_copy.h"
#include "core/scene/scene_loader.h"
#include "optim/experiment/files.h"
#include "optim/problem/evidence.h"
#include "optim/problem/goodness_of_fit.h"
#include "optim/problem/penalties.h"
#include "optim/remesh/folds.h"
#include "optim/remesh/remesh.h"
#include "optim/run/geometry_files.h"
#include "optim/run/level_log.h"
#include "optim/run/level_settings.h"
#include "optim/run/summary.h"

namespace isochron {
namespace {

namespace fs = std::filesystem;

/// What summary.yaml has of a level.
struct Level {
  double edge_length = 0;  ///< mean over its mesh
  int vertices = 0;
  long long iterations = 0;
  double loss = 0, seconds = 0;
  std::string status;
};

/// Of the first level, 1, what the experiment says, or else what the mesh has.
double edge_length_of(int level, const RemeshSpec& remesh, const Mesh& loaded) {
  const double first = remesh.edge_length > 0 ? remesh.edge_length : mean_edge_length(loaded);
  return std::ldexp(first, -remesh.halvings(level));
}

/// Levels that fitted the noise of the same random numbers would not find each other's errors.
std::uint64_t seed_of(int level, std::uint64_t seed) {
  constexpr std::uint64_t kApart = 0x9e3779b97f4a7c15;  // 2^64 over the golden ratio: nobody chooses seeds so far apart
  constexpr std::uint64_t kMostSeed = std::numeric_limits<long long>::max();
  return (seed + (level - 1) * kApart) & kMostSeed;
}

void write_surface(const std::string& file, const Mesh& mesh) {
  const Scene scene = scene_of(mesh);
  write_file_atomically(file, to_ply(scene, scene.shapes[0]));
}

/// Least area of a part or a hole that an outline may cut, in squared edge lengths: smaller ones hold one or two vertices, which is noise.
constexpr double kLeastPart = 2;

/// By how much evidence changes a weight from level to level, at most. Its rule holds where a fit has come to rest. After two iterations a surface
/// is still rough, which evidence would take for its nature (optim/README.md, Smoothing).
constexpr double kMostChange = 10;

/// A number, or null where it is none.
double number_or_nan(const YamlValue& value) {
  return value.is_number() ? value.number() : std::nan("");
}

class Levels {
 public:
  Levels(const Experiment& experiment, const RunOptions& options,
         const std::function<RunStatus(const RunOptions&)>& run_level)
      : experiment_(experiment),
        remeshed_(*remeshed_parameter(experiment)),
        options_(options),
        run_level_(run_level),
        folder_(fs::weakly_canonical(fs::absolute(options.folder)).string()) {}

  RunStatus execute() {
    try {
      write_target();
      const Mesh loaded = mesh_of(load_scene(experiment_.scene), remeshed_.shape);
      const auto ready = [&](int each) { return file_exists(folder(each) + "/experiment.yaml"); };
      for (int level = 1;; ++level) {
        if (!ready(level)) prepare(level, edge_length_of(level, remeshed_.remesh, loaded));
        if (ready(level + 1)) {  // which begins once this one has brought what it has
          on_first_rank([&] { levels_.push_back(found_level(level)); });
          continue;
        }
        status_ = run(level);
        const bool ended = status_ != RunStatus::interrupted && status_ != RunStatus::diverged;
        const bool more = ended && is_followed(level);
        on_first_rank([&] { publish(level, more); });
        if (!more) break;
      }
    } catch (const Interrupted&) {
      status_ = RunStatus::interrupted;
    }
    if (options_.report && status_ != RunStatus::interrupted) options_.report(report_ + table());
    return status_;
  }

 private:
  std::string folder(int level) const { return fmt::format("{}/levels/{}", folder_, level); }
  std::string file(const char* name) const { return folder_ + "/" + name; }

  void write_target() const {
    if (file_exists(file("target.exr"))) return;
    const Problem problem(experiment_);
    const Parameters& parameters = problem.parameters();
    GeometryFiles(folder_, experiment_.output, parameters).write("target", parameters.target());
    write_exr(file("target.exr"), problem.make_target(), exr_notes(experiment_.gates));
  }

  /// Makes the level's folder.
  void prepare(int level, double edge_length) {
    Experiment next = experiment_;
    if (!next.target.measured()) next.target.images = file("target.exr");
    next.seed = seed_of(level, experiment_.seed);
    if (remeshed_.remesh.spares_histograms(level)) next.target.histograms = remeshed_.remesh.coarse_histograms;
    if (remeshed_.remesh.steps_by_adam(level)) step_by_adam(remeshed_.remesh, level, next);
    std::optional<LevelSurface> surface;
    if (level == 1 && remeshed_.remesh.edge_length == 0) {
      for (ParameterSpec& spec : next.parameters) spec.remesh = {};
      set_weights(experiment_, level, false, next.parameters);
    } else {
      const bool first = level == 1;
      const std::string before = first ? "" : folder(level - 1);
      const Problem former(first ? experiment_ : load_experiment(before + "/experiment.yaml"));
      const std::vector<double> theta =
          first ? former.parameters().initial() : final_values(before + "/summary.yaml", former.parameters());
      surface = found_surface(former, theta, remeshed_);
      if (!first) {
        surface->mesh = unfolded(std::move(surface->mesh));
        surface = without_small_features(*surface, edge_length, remeshed_.remesh.outline > 0);
      }
      if (remeshed_.remesh.finds_outline(level - 1))
        surface = within_outline(*surface, former.experiment().parameters, remeshed_.remesh.outline,
                                 kLeastPart * edge_length * edge_length);
      surface = remeshed_surface(*surface, edge_length);
      next.parameters = next_parameters(former, theta, remeshed_, *surface);
      const bool follows = level > remeshed_.remesh.coarse_levels;
      set_weights(experiment_, level, follows, next.parameters);
      // As long as a surface has far to go, what it does not explain yet would pass for roughness.
      if (follows) follow_evidence(former, theta, before, next.parameters);
      if (remeshed_.remesh.steps_by_adam(level) && level == remeshed_.remesh.first_by_adam())
        dim(remeshed_.shape, next.parameters);
      next.scene = folder(level) + "/scene/scene.yaml";
    }
    on_first_rank([&] { write_level(level, next, surface); });
  }

  void follow_evidence(const Problem& former, const std::vector<double>& theta, const std::string& folder,
                       std::vector<ParameterSpec>& next) {
    if (std::none_of(next.begin(), next.end(), [](const ParameterSpec& spec) { return spec.evidence; })) return;
    const ProgressStage stage("weighing the smoothing", 1);
    const std::vector<double> factors =
        evidence_.empty() ? evidence_factors(former, former.read_target(folder + "/target.exr"), theta)
                          : std::exchange(evidence_, {});
    for (std::size_t i = 0; i < next.size(); ++i)
      next[i].*weight_by_evidence(next[i]) *= std::clamp(factors[i], 1 / kMostChange, kMostChange);
  }

  void write_level(int level, const Experiment& next, const std::optional<LevelSurface>& surface) const {
    make_output_folder(folder(level));
    if (surface) {
      const std::string place = folder(level) + "/scene", mesh = place + "/surface.ply";
      make_output_folder(place);
      write_surface(mesh, surface->mesh);
      write_file_atomically(next.scene, scene_with_mesh(experiment_.scene, remeshed_.shape, mesh, place));
    }
    write_file_atomically(folder(level) + "/experiment.yaml", resolved_yaml(next, folder(level)));
  }

  /// Runs the level unless that is done.
  RunStatus run(int level) {
    if (has_ended(folder(level) + "/summary.yaml") && is_followed(level)) return ended_as(level);
    RunOptions options = options_;
    options.folder = folder(level);
    options.errors = level >= remeshed_.remesh.levels;
    options.followed_unless_explained = level < remeshed_.remesh.most_levels();
    options.earlier = {remeshed_.shape, options.errors ? earlier_surfaces(level) : std::vector<std::string>{}};
    evidence_.clear();
    options.evidence = [this](std::vector<double> factors) { evidence_ = std::move(factors); };
    options.report = [this](const std::string& text) { report_ = text; };
    // Losses of a level by adam scatter by design. The levels that follow show what came of it.
    if (remeshed_.remesh.steps_by_adam(level)) options.warning = {};
    options.progress = [this, level](Progress progress) {
      progress.level = level;
      progress.levels = std::max(level, remeshed_.remesh.levels);
      if (options_.progress) options_.progress(progress);
    };
    return run_level_(options);
  }

  /// What levels before `level` have found, where some of them search for the outline. Others refine one minimum.
  std::vector<std::string> earlier_surfaces(int level) const {
    std::vector<std::string> meshes;
    if (!remeshed_.remesh.steps_by_adam(remeshed_.remesh.first_by_adam())) return meshes;
    for (int next = 2; next <= level; ++next) meshes.push_back(folder(next) + "/scene/surface.ply");
    return meshes;
  }

  /// Of a level that has ended.
  bool is_followed(int level) const {
    if (level < remeshed_.remesh.levels) return true;
    if (level >= remeshed_.remesh.most_levels()) return false;
    YamlMap summary = open_yaml(folder(level) + "/summary.yaml").map();
    const std::optional<YamlValue> fit = summary.find("fit");
    return fit && fit->map().require("verdict").text() == name(FitVerdict::unexplained);
  }

  RunStatus ended_as(int level) const {
    const std::string status = open_yaml(folder(level) + "/summary.yaml").map().require("status").text();
    return status == name(RunStatus::diverged)    ? RunStatus::diverged
           : status == name(RunStatus::converged) ? RunStatus::converged
                                                  : RunStatus::iterations_reached;
  }

  /// Brings what the level has to DIR, the summary last. `more`: it may not be the last.
  void publish(int level, bool more) {
    levels_.push_back(found_level(level));
    const std::string from = folder(level);
    if (status_ != RunStatus::interrupted) {
      if (level == 1) copy(from, {"initial.exr"}, "initial_");
      copy(from, {"final.exr", "final.h5"}, "final_");
      write_file_atomically(file("log.csv"), joined_logs(logs()));
    }
    write_summary(more);
  }

  /// Of the last level that has ended, as the other files are. As long as there may be more, the run counts as interrupted.
  void write_summary(bool more) const {
    const bool under_way = levels_.back().status == name(RunStatus::interrupted);
    const int level = std::max(1, static_cast<int>(levels_.size()) - (under_way ? 1 : 0));
    std::string text = *read_file(folder(level) + "/summary.yaml");
    if (more || under_way)
      text = fmt::format("status: {}{}", name(RunStatus::interrupted), text.substr(text.find('\n')));
    write_file_atomically(file("summary.yaml"), text + read_file(file("start.yaml")).value_or("") + levels_yaml());
  }

  /// Files of those names, and meshes whose names begin so.
  void copy(const std::string& from, const std::vector<std::string>& files, const std::string& moment) const {
    const auto copy_file = [&](const std::string& each) {
      if (const auto contents = read_file(from + "/" + each)) write_file_atomically(folder_ + "/" + each, *contents);
    };
    for (const std::string& each : files) copy_file(each);
    if (!fs::exists(from + "/geometry")) return;
    fs::create_directories(folder_ + "/geometry");
    for (const auto& entry : fs::directory_iterator(from + "/geometry"))
      if (const std::string mesh = entry.path().filename().string(); mesh.starts_with(moment))
        copy_file("geometry/" + mesh);
  }

  std::vector<std::string> logs() const {
    std::vector<std::string> texts;
    for (std::size_t i = 1; i <= levels_.size(); ++i)
      texts.push_back(*read_file(folder(static_cast<int>(i)) + "/log.csv"));
    return texts;
  }

  Level found_level(int level) const {
    const Experiment experiment = load_experiment(folder(level) + "/experiment.yaml");
    const Mesh mesh = mesh_of(load_scene(experiment.scene), remeshed_.shape);
    YamlMap summary = open_yaml(folder(level) + "/summary.yaml").map();
    return {mean_edge_length(mesh),
            static_cast<int>(mesh.positions.size()),
            summary.require("iterations").integer(0, kMostIterations),
            number_or_nan(summary.require("loss_final")),
            summary.require("seconds").number(),
            summary.require("status").text()};
  }

  std::string levels_yaml() const {
    std::string text = "levels:\n";
    for (const Level& level : levels_)
      text += fmt::format("  - {{edge_length: {}, vertices: {}, iterations: {}, loss: {}, seconds: {}, status: {}}}\n",
                          level.edge_length, level.vertices, level.iterations,
                          std::isnan(level.loss) ? "null" : exact(level.loss), level.seconds, level.status);
    return text;
  }

  /// For the screen.
  std::string table() const {
    std::string text = fmt::format("  {:>5}  {:>11}  {:>8}  {:>10}  {:>10}  {:>8}\n", "level", "edge length",
                                   "vertices", "iterations", "loss", "seconds");
    int number = 0;
    for (const Level& level : levels_)
      text += fmt::format("  {:>5}  {:>11.4g}  {:>8}  {:>10}  {:>10.3g}  {:>8.3g}\n", ++number, level.edge_length,
                          level.vertices, level.iterations, level.loss, level.seconds);
    return text;
  }

  const Experiment& experiment_;
  const ParameterSpec& remeshed_;
  const RunOptions& options_;
  const std::function<RunStatus(const RunOptions&)>& run_level_;
  const std::string folder_;  ///< absolute
  std::vector<Level> levels_;
  std::vector<double> evidence_;  ///< factors at the end of the level that ran last; empty: not known
  RunStatus status_ = RunStatus::iterations_reached;
  std::string report_;
};

}  // namespace

void require_levels(const Problem& problem) {
  const ParameterSpec* remeshed = remeshed_parameter(problem.experiment());
  if (!remeshed) return;
  if (remeshed->remesh.coarse_histograms > 0 && !problem.scene().capture)
    remeshed->fail("remesh", "coarse_histograms: belongs to captures; a camera's pixels are all used", "0");
  const RemeshSpec& remesh = remeshed->remesh;
  if (remesh.adam_iterations > 0 && remesh.last_by_adam() < remesh.first_by_adam())
    remeshed->fail("remesh", "adam: there is no coarse level for it",
                   fmt::format("coarse_levels: at least {}", remesh.outline > 0 ? 4 : 3));
  const Mesh loaded = mesh_of(problem.scene(), remeshed->shape);
  try {
    require_remeshable(loaded, edge_length_of(remeshed->remesh.most_levels(), remeshed->remesh, loaded));
  } catch (const InputError& error) {
    remeshed->fail("remesh", fmt::format("the mesh of '{}' {}", remeshed->shape, error.what()));
  }
}

std::string last_level_folder(const std::string& folder) {
  std::string last = folder;
  for (int level = 1;; ++level) {
    const std::string next = fmt::format("{}/levels/{}", folder, level);
    if (!file_exists(next + "/experiment.yaml")) return last;
    last = next;
  }
}

RunStatus run_levels(const Experiment& experiment, const RunOptions& options,
                     const std::function<RunStatus(const RunOptions&)>& run_level) {
  return Levels(experiment, options, run_level).execute();
}

}  // namespace isochron
