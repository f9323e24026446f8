#include "optim/run/run.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>

#include "core/base/clock.h"
#include "core/base/description.h"
#include "core/base/error.h"
#include "core/base/file.h"
#include "core/base/ranks.h"
#include "core/image/image.h"
#include "optim/experiment/files.h"
#include "optim/problem/capture_data.h"
#include "optim/problem/darkness.h"
#include "optim/problem/evidence.h"
#include "optim/problem/jacobian.h"
#include "optim/problem/joint_errors.h"
#include "optim/problem/loss.h"
#include "optim/problem/memory.h"
#include "optim/problem/problem.h"
#include "optim/problem/rendered_curvature.h"
#include "optim/problem/rendered_objective.h"
#include "optim/problem/surface_errors.h"
#include "optim/problem/vector_math.h"
#include "optim/run/bounds.h"
#include "optim/run/checkpoint.h"
#include "optim/run/fit.h"
#include "optim/run/frames.h"
#include "optim/run/geometry_files.h"
#include "optim/run/inputs.h"
#include "optim/run/levels.h"
#include "optim/run/log.h"
#include "optim/run/next_level.h"
#include "optim/run/report.h"
#include "optim/run/run_folder.h"
#include "optim/run/summary.h"
#include "optim/run/zero_gradient.h"

namespace isochron {
namespace {

/// Most memory that the process has had, in bytes.
long long peak_memory() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return 1024LL * usage.ru_maxrss;
}

/// In the folder of a run whose loss is not the experiment's.
constexpr const char* kOwnLossFile = "own_loss.yaml";

/// Throws InputError where a run is to go on with another loss than it began with.
void require_same_loss(const RunOptions& options) {
  const std::string file = options.folder + "/" + kOwnLossFile;
  const bool had = file_exists(file);
  if (had && !options.loss)
    throw InputError(fmt::format(
        "{}: this run minimises a loss of its own, {} (allowed: isochron.resume(folder, loss=...) in Python)",
        options.folder, open_yaml(file).map().require("loss").text()));
  if (!had && options.loss)
    throw InputError(fmt::format("{}: this run began with the experiment's loss (allowed: to resume it without loss=)",
                                 options.folder));
}

/// What a resumption says that made no step.
std::string nothing_left(const LoopResult& result, const std::string& folder) {
  return fmt::format("nothing was left to do: the run had ended before{}\n",
                     result.status == RunStatus::iterations_reached
                         ? fmt::format(" (to go on, raise optimizer.iterations in {}/experiment.yaml)", folder)
                         : "");
}

class Run {
 public:
  Run(const Problem& problem, const RunOptions& options)
      : problem_(problem), parameters_(problem.parameters()), options_(options) {}

  RunStatus execute() {
    std::string warning;
    const auto saved = load_checkpoint(options_.folder, parameters_, &warning);
    if (!warning.empty() && options_.warning) options_.warning(warning);
    if (saved) state_ = *saved;
    const bool had_ended = has_ended(path("summary.yaml"));
    const int first = state_.iteration;
    const Clock::time_point start = Clock::now();
    if (!saved) state_.theta = parameters_.initial();
    last_.loss = last_.loss_noise = last_.image_rmse = last_.param_rmse = std::numeric_limits<double>::quiet_NaN();
    LoopResult result;
    try {
      load_target();
      result = optimise();
    } catch (const Interrupted&) {
      // Once the parameters are final, the checkpoint of the last iteration leads to the same again.
      if (!is_final_) save_checkpoint(options_.folder, state_, parameters_);
      result.status = RunStatus::interrupted;
    }
    // Ranks that were told to stop do not wait for each other.
    const long long rays = result.status == RunStatus::interrupted ? problem_.rays() : sum_over_ranks(problem_.rays());
    RunCost cost{first, seconds_since(start), rays, peak_memory(), {{"target", target_seconds_}}};
    for (PassKind kind : kPassKinds) cost.passes.emplace_back(name(kind), problem_.times().seconds(kind));
    write_file_atomically(path("summary.yaml"), summary_yaml(result, state_, last_, parameters_, cost, errors_, fit_));
    if (options_.report)
      options_.report((had_ended && state_.iteration == first ? nothing_left(result, options_.folder) : "") +
                      run_report(result, state_, last_, parameters_, errors_, fit_) + zero_gradients_);
    return result.status;
  }

 private:
  std::string path(const char* file) const { return options_.folder + "/" + file; }

  void load_target() {
    const std::string file = path("target.exr");
    const Clock::time_point start = Clock::now();
    if (!aims_at_images_) {
      target_ = problem_.blank();
      return;
    }
    if (!file_exists(file)) write_exr(file, problem_.make_target(), notes_);
    target_ = problem_.read_target(file);
    target_seconds_ = seconds_since(start);
  }

  std::unique_ptr<const Objective> make_objective() const {
    if (options_.loss) return std::make_unique<OwnLossObjective>(problem_, target_, options_.loss);
    return std::make_unique<RenderedObjective>(problem_, target_);
  }

  LoopResult optimise() {
    const OptimizerSpec& spec = problem_.experiment().optimizer;
    const std::unique_ptr<const Objective> objective = make_objective();
    const auto optimizer = make_optimizer(spec, problem_.preconditioner(), parameters_.scales());
    const GeometryFiles geometry(options_.folder, problem_.experiment().output, parameters_);
    if (state_.iteration == 0) geometry.write("target", parameters_.target());
    Log log(path("log.csv"), parameters_, state_.iteration);
    const Frames frames(options_.folder, problem_.experiment().output.frames, target_, notes_);
    const Clock::time_point call_start = Clock::now();
    Clock::time_point iteration_start = call_start;
    const int first = state_.iteration;
    LoopOptions loop;
    loop.iterations = spec.iterations;
    if (!options_.loss) loop.converged_rmse = spec.tolerance * std::sqrt(mean_square(target_, problem_.readings()));
    loop.warning = options_.warning;
    loop.row = [&](const Evaluation& now, const std::vector<double>& theta, bool closing) {
      last_ = {
          state_.iteration + (closing ? 1 : 0),
          state_.seconds + seconds_since(iteration_start),
          now.loss,
          std::isnan(now.mean_squared_error) ? now.mean_squared_error : root_mean_square_error(now.mean_squared_error),
          parameters_.distance_to_target(theta),
          scaled_norm(now.gradient),
          now.loss_noise};
      if (last_.iteration == 0) {
        write_exr(path("initial.exr"), now.image, notes_);
        geometry.write("initial", theta);
        if (const std::string dark = aims_at_images_ ? darkness_warning(problem_, theta, now.image, target_)
                                                     : darkness_warning(problem_, theta, now.image, "the image");
            options_.warning && !dark.empty())
          options_.warning(dark);
        state_.image_rmse_initial = last_.image_rmse;
        state_.param_rmse_initial = last_.param_rmse;
      }
      if (!closing) {
        geometry.write_iteration(last_.iteration, theta);
        if (frames.wants(last_.iteration)) {
          frames.write(last_.iteration, now.image);
          geometry.write("current", theta);
        }
      }
      log.append(last_, theta, now.gradient);
      if (!closing) report(first, seconds_since(call_start));
      if (options_.row) options_.row(last_, theta, now, closing);
    };
    ProgressStage stage("optimising", std::max(1, spec.iterations - first));
    loop.save = [&] {
      state_.seconds += seconds_since(iteration_start);
      iteration_start = Clock::now();
      save_checkpoint(options_.folder, state_, parameters_);
      throw_if_stopped();
      stage.advance();
    };
    LoopResult result = run_loop(*objective, *optimizer, spec.window(), loop, state_);
    is_final_ = true;
    write_exr(path("final.exr"), result.final.image, notes_);
    std::optional<RenderedCurvature> curvature;
    PosteriorSamples samples;
    if (options_.errors && !options_.loss && has_errors()) {
      curvature.emplace(problem_, target_, state_.theta);
      samples = posterior_samples(*curvature);
    }
    judge_expected_counts();
    std::vector<double> of_surfaces;
    const bool followed = options_.followed_unless_explained && fit_ && fit_->verdict() == FitVerdict::unexplained;
    if (followed && options_.evidence && samples.count() > 0)
      options_.evidence(evidence_factors(problem_, target_, state_.theta, samples));
    if (curvature && !followed)
      of_surfaces = find_errors(*curvature, samples, {variance_scale(problem_, result.final), optimizer->scatters()});
    geometry.write("final", state_.theta, of_surfaces);
    geometry.remove("current");
    // Of levels that others follow a noisier iteration at the end says little.
    if (fit_ && (options_.errors ? left_its_data(*fit_, state_, last_) : fit_->lost()))
      result.status = RunStatus::diverged;
    zero_gradients_ = zero_gradient_report(parameters_, result.final.gradient);
    return result;
  }

  /// Whether errors are of all unknowns together, as their matrix is not too large.
  bool together() const {
    const double unknowns = parameters_.size();
    return unknowns <= kMostTogether && linearisation_bytes(problem_, unknowns) <= kMostLinearisationBytes;
  }

  bool has_errors() const { return problem_.can_render(state_.theta) && (together() || !problem_.by_differences()); }

  /// Of the final parameters, where anything is made of them.
  PosteriorSamples posterior_samples(const RenderedCurvature& curvature) {
    const bool surfaces = has_surface_errors(problem_);
    if (problem_.by_differences() || !(surfaces || (has_fit(problem_, target_) && !problem_.penalty().empty())))
      return {};
    PosteriorSamples samples = curvature.samples();
    determined_ = determined_unknowns(problem_, free_unknowns(problem_, state_.theta), samples);
    return samples;
  }

  /// Returns those of surfaces, where there are any.
  std::vector<double> find_errors(const RenderedCurvature& curvature, const PosteriorSamples& samples,
                                  const NoiseLevel& noise) {
    const std::vector<double>& theta = state_.theta;
    const std::vector<Parameters::Block>& blocks = parameters_.blocks();
    const std::vector<std::string>& names = parameters_.component_names();
    errors_ = together() ? joint_errors(curvature.all(), curvature.gradients(), noise, blocks, names, theta)
                         : eliminated_errors(curvature, curvature.diagonal(), curvature.prior_diagonal(),
                                             curvature.gradients(), noise, blocks, names, theta);
    drop_held_steps(parameters_, theta, errors_);
    if (samples.count() == 0 || !has_surface_errors(problem_)) return {};
    std::vector<double> errors = surface_errors(problem_, samples, theta, noise.scale);
    if (!options_.earlier.meshes.empty())
      add_level_scatter(options_.earlier, parameters_.apply(offsets_alone(problem_, theta, options_.earlier.shape)),
                        errors);
    return errors;
  }

  /// What the final parameters make of the counts, with far less noise than an iteration's image.
  void judge_expected_counts() {
    const Experiment& experiment = problem_.experiment();
    const bool counts = !options_.loss && has_fit(problem_, target_),
               histograms = has_histograms(experiment, problem_.scene());
    if ((!counts && !histograms) || !problem_.can_render(state_.theta)) return;
    SplitImage expected;
    if (counts)
      fit_ = judge_rendered_fit(problem_, state_.theta, target_, expected, determined_,
                                options_.errors ? kMostDoublings : 0);
    else
      expected.image = problem_.render_in_parts(state_.theta, problem_.estimator(), problem_.stream(Pass::histograms),
                                                experiment.output.histogram_samples, "rendering the expected counts");
    if (histograms) write_histograms(path("final.h5"), experiment, problem_.scene(), expected.image);
  }

  double scaled_norm(std::vector<double> gradient) const {
    const std::vector<double> scales = parameters_.scales();
    for (std::size_t i = 0; i < gradient.size(); ++i) gradient[i] *= scales[i];
    return norm(gradient);
  }

  void report(int first, double seconds) const {
    if (!options_.progress) return;
    const int iterations = problem_.experiment().optimizer.iterations;
    const double each = seconds / (state_.iteration - first + 1);
    options_.progress(
        {state_.iteration, iterations, last_.loss, last_.param_rmse, each, each * (iterations - state_.iteration)});
  }

  const Problem& problem_;
  const Parameters& parameters_;
  const RunOptions& options_;
  const ExrNotes notes_ = exr_notes(problem_.experiment().gates);
  const bool aims_at_images_ = !options_.loss || has_target(problem_);
  Checkpoint state_;
  bool is_final_ = false;  ///< what `state_` has are the parameters that are reported, which no iteration goes on from
  GatedImage target_;      ///< black where there is none
  double target_seconds_ = 0;
  LogRow last_;
  ParameterErrors errors_;
  std::optional<double> determined_;  ///< of the unknowns, where penalties hold some
  std::optional<GoodnessOfFit> fit_;  ///< of counts
  std::string zero_gradients_;        ///< for the screen
};

/// Goes on in a locked folder that holds a run.
RunStatus go_on(const RunOptions& options, const std::function<void(const std::string&)>& warning_of_scene) {
  require_same_loss(options);
  const Experiment experiment = load_experiment(options.folder + "/experiment.yaml", {}, !options.loss);
  if (remeshed_parameter(experiment)) {
    return run_levels(experiment, options, [](const RunOptions& level) {
      std::optional<FolderLock> lock;
      on_first_rank([&] { lock.emplace(level.folder, level.warning); });
      return go_on(level, {});
    });
  }
  const Problem problem(experiment, warning_of_scene);
  require_optimisable(problem);
  return Run(problem, options).execute();
}

}  // namespace

RunStatus start_run(const Experiment& experiment, const RunOptions& options) {
  Experiment copied = experiment;
  {
    const Problem problem(experiment, options.warning);
    require_optimisable(problem);
    require_memory(problem, run_memory(problem));
    require_levels(problem);
    if (options.loss) require_for_own_loss(problem);
    // Here, so that a message names the user's file and not the run's copy of it.
    if (!experiment.target.images.empty()) problem.read_target(experiment.target.images);
    for (const ParameterSpec& spec : experiment.parameters)
      if (spec.evidence && !remeshed_parameter(experiment) && options.warning)
        options.warning(
            fmt::format("{}: {}: smoothing.evidence chooses weights between levels (remesh), which are missing",
                        experiment.file, spec.name));
    if (problem.leaves_out_jumps()) {
      copied.samples.path_length = experiment.samples.interior;
      if (options.warning)
        options.warning(fmt::format("{}: samples.path_length: taken as {}, as of interior", experiment.file,
                                    experiment.samples.interior));
    }
  }
  std::optional<FolderLock> lock;
  on_first_rank([&] {
    const std::vector<FileCopy> inputs = collect_inputs(experiment);  // before a folder is cleared that may hold them
    lock.emplace(prepare_run_folder(options.folder, options.force, options.warning));
    write_inputs(options.folder, inputs, copied);
    const std::string own_loss = options.folder + "/" + kOwnLossFile;
    if (options.loss)
      write_file_atomically(own_loss, fmt::format("loss: {}\n", yaml_text(options.loss_name)));
    else
      std::filesystem::remove(own_loss);
    for (const auto& [name, contents] : options.files) write_file_atomically(options.folder + "/" + name, contents);
    write_file_atomically(options.folder + "/experiment.yaml", resolved_yaml(copied, options.folder));
  });
  // As a resumed run does, so that both see the same to the last bit.
  return go_on(options, {});
}

RunStatus resume_run(const RunOptions& options) {
  std::optional<FolderLock> lock;
  on_first_rank([&] {
    if (!file_exists(options.folder + "/experiment.yaml"))
      throw InputError(fmt::format("{}: holds no run to resume (there is no experiment.yaml)", options.folder));
    make_output_folder(options.folder);
    lock.emplace(options.folder, options.warning);
    check_inputs(options.folder, options.warning);
  });
  return go_on(options, options.warning);
}

}  // namespace isochron
