#include "optim/problem/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "core/base/parallel.h"
#include "core/paths/differentiable.h"
#include "core/scene/behind_wall.h"
#include "core/scene/scene_loader.h"
#include "core/scene/stacked_faces.h"
#include "optim/problem/capture_data.h"
#include "optim/problem/dark_bins.h"
#include "optim/problem/loss.h"

namespace isochron {
namespace {

Scene load_scene_at(const Experiment& experiment) {
  Scene scene = load_scene(experiment.scene);
  make_room(scene, experiment.parameters);
  mark_hidden(scene, experiment);
  if (experiment.resolution[0] > 0) {
    if (scene.capture)
      throw InputError(experiment.file + ": resolution: belongs to cameras; a capture has its sensor's grid");
    scene.camera.width = experiment.resolution[0];
    scene.camera.height = experiment.resolution[1];
  }
  return scene;
}

/// The bound parameters; backgrounds of counts begin at their dark bins.
std::unique_ptr<Parameters> bind_parameters(Experiment& experiment, const Scene& scene,
                                            const std::optional<GatedImage>& counts, const Readings& readings) {
  const bool likelihood = experiment.loss.kind == LossKind::poisson;
  begin_at_dark_bins(experiment.parameters, counts && likelihood ? &*counts : nullptr, readings,
                     scene.capture ? static_cast<int>(scene.capture->sensor.size()) : 1);
  return std::make_unique<Parameters>(scene, experiment.parameters, length_unit(experiment.gates));
}

/// How the rays' hierarchy is updated. Rebuilding it costs as much time as kRaysPerTriangle rays for each triangle lose in a
/// refitted one (a ball of 70 000 triangles, 32 x 32 pixels: 0.33 us of one core per triangle, 14 ns
/// per ray); a sample takes about kRaysPerSample.
CasterUpdate caster_update(const Experiment& experiment, const Scene& scene) {
  constexpr double kRaysPerTriangle = 20, kRaysPerSample = 6;
  const SampleSpec& samples = experiment.samples;
  const double per_pixel = double{1} * samples.primal + samples.interior + samples.visibility + samples.path_length;
  const double rays = kRaysPerSample * per_pixel * scene.camera.width * scene.camera.height;
  return rays < kRaysPerTriangle * static_cast<double>(scene.triangles.size()) ? CasterUpdate::refit
                                                                               : CasterUpdate::rebuild;
}

int pixels_of(const Scene& scene) {
  return scene.camera.width * scene.camera.height;
}

}  // namespace

Pass pass_of(Term term) {
  switch (term) {
    case Term::interior:
      return Pass::interior;
    case Term::visibility:
      return Pass::visibility;
    case Term::path_length:
      return Pass::path_length;
  }
  throw std::logic_error("unknown term");
}

SplitImage render_halves(const Renderer& renderer, const Stream& stream, SampleRange range) {
  if (range.count() < 2) return {renderer.render(stream, range), {}, 1};
  const int middle = range.begin + (range.count() + 1) / 2;
  const SampleRange first{range.begin, middle}, second{middle, range.end};
  return join_halves(renderer.render(stream, first), first.count(), renderer.render(stream, second), second.count());
}

void ImageMean::add(const GatedImage& image, int samples) {
  if (samples_ == 0) sum_ = GatedImage(image.width, image.height, image.gates, image.channels);
  parallel_ranges(image.data.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) sum_.data[i] += samples * image.data[i];
  });
  samples_ += samples;
}

GatedImage ImageMean::mean() const {
  GatedImage mean = sum_;
  for (double& value : mean.data) value /= static_cast<double>(samples_);
  return mean;
}

void set_loss(const LossEstimate& estimate, Evaluation& into) {
  into.loss = estimate.value;
  into.loss_noise = estimate.noise;
  into.mean_squared_error = estimate.mean_squared_error;
  into.mean_squared_error_noise = estimate.mean_squared_error_noise;
}

Problem::Problem(Experiment experiment, const std::function<void(const std::string&)>& warning)
    : experiment_(std::move(experiment)),
      scene_(load_scene_at(experiment_)),
      counts_(read_counts(experiment_, scene_, warning)),
      gates_(make_gates(experiment_.gates)),
      readings_(make_readings(experiment_, gates_, scene_.camera.width, scene_.camera.height,
                              scene_.capture ? scene_.camera.height / scene_.capture->rows : 1)),
      parameters_(bind_parameters(experiment_, scene_, counts_, readings_)),
      caster_update_(caster_update(experiment_, scene_)),
      cache_(std::make_unique<SceneCache>(scene_, caster_update_)),
      evaluations_(std::max(1, experiment_.optimizer.iterations)) {
  if (experiment_.target.histograms > 0) leave_out_histograms();
  if (scene_.capture && experiment_.estimator.light.value_or(0) > 0)
    experiment_.estimator_keys.at("light").fail("paths of captures have no light subpaths", "allowed here: 0");
  if (const double unit = experiment_.gates.scene_unit_m;
      scene_.capture && !scene_.capture->file.empty() && unit > 0 && unit != 1)
    throw InputError(fmt::format("{}: gates.scene_unit_m: {}, but the points of {} are in metres (allowed here: 1)",
                                 experiment_.file, unit, scene_.capture->file));
  if (counts_) {
    settle_unused(*counts_, readings_, experiment_.target.capture);
    require_usable(*counts_, experiment_.target.capture);
  }
  const SampleSpec& samples = experiment_.samples;
  choice_ = {
      {samples.primal, samples.interior, samples.visibility, samples.path_length}, experiment_.seed, evaluations_};
  for (std::size_t i = 0; i < experiment_.parameters.size(); ++i) {
    const ParameterSpec& spec = experiment_.parameters[i];
    const Parameters::Block& block = parameters_->blocks()[i];
    if (spec.diffusion > 0) preconditioner_.add_diffusion(scene_, parameters_->vertex_field(block), spec.diffusion);
    if (spec.evidence && by_differences())
      spec.fail("smoothing", "evidence needs products with the Jacobian, which finite differences have not",
                "gradient: {method: analytic}");
    const bool smooth_prior = spec.bends() || spec.tangential > 0 || spec.evidence;
    if ((spec.prior_width > 0 || smooth_prior) && experiment_.loss.kind != LossKind::poisson)
      spec.fail(smooth_prior ? "smoothing" : "prior_width", "the loss is no likelihood", "loss: {kind: poisson}");
  }
  penalty_ = penalty_of(experiment_.parameters, *parameters_, scene_);
  if (!can_render(parameters_->initial()) || (parameters_->target_known() && !can_render(parameters_->target())))
    throw InputError(
        fmt::format("{}: parameters: initial or target values put a vertex too far away (allowed: "
                    "coordinates of at most {})",
                    experiment_.file, kLargestCoordinate));
  for (const std::vector<double>* theta : {&parameters_->initial(), &parameters_->target()})
    if (scene_.capture && (theta == &parameters_->initial() || parameters_->target_known()))
      if (const std::string complaint = behind_wall(parameters_->apply(*theta)); !complaint.empty())
        throw InputError(experiment_.scene + ": " + complaint);
  if (!warning) return;
  if (scene_.capture)
    for (const std::string& line : scene_.capture->assumed) warning(scene_.capture->file + ": " + line);
  if (const std::string name = light_that_leaves_the_camera(); !name.empty())
    warning(
        fmt::format("{}: light '{}' is at the camera's position: if only one of them moves, a shadow appears whichever "
                    "way it goes, so "
                    "derivatives are one-sided",
                    experiment_.file, name));
  if (leaves_out_jumps())
    warning(
        fmt::format("{}: samples.path_length: 0 leaves out the gate-edge (path-length) boundary term: derivatives by "
                    "parameters that change path lengths are biased",
                    experiment_.file));
  std::string stacked = stacked_warning(parameters_->apply(parameters_->initial()));
  if (stacked.empty() && parameters_->target_known())
    stacked = stacked_warning(parameters_->apply(parameters_->target()));
  if (!stacked.empty()) warning(experiment_.scene + ": " + stacked);
}

void Problem::leave_out_histograms() {
  if (!scene_.capture)
    throw InputError(experiment_.file + ": target.histograms: belongs to captures; a camera's pixels are all used");
  all_readings_ = readings_;
  share_of_histograms_ = choose_pixels(readings_, pixels_of(scene_), experiment_.target.histograms);
  scene_.capture->left_out = readings_.left_out();
}

bool Problem::redraws_histograms() const {
  return share_of_histograms_ < 1 && experiment_.optimizer.method == OptimizerMethod::adam &&
         experiment_.gradient.method == GradientMethod::analytic;
}

Readings Problem::drawn_readings(std::uint32_t iteration) const {
  Readings readings = all_readings_;
  readings.drawn = choose_pixels(readings, pixels_of(scene_), experiment_.target.histograms, iteration);
  return readings;
}

bool Problem::leaves_out_jumps() const {
  if (experiment_.samples.path_length > 0 || experiment_.gradient.method != GradientMethod::analytic) return false;
  if (!(gates_.shape().pair_mass(PairPart::dirac) > 0)) return false;
  const TangentBasis basis = parameters_->tangent(parameters_->initial());
  return Differentiable(parameters_->apply(parameters_->initial()), &basis).lengths;
}

std::string Problem::light_that_leaves_the_camera() const {
  const std::vector<double>& theta = parameters_->initial();
  const Scene scene = parameters_->apply(theta);
  const TangentBasis basis = parameters_->tangent(theta);
  const DofLayout layout(scene);
  for (int i = 0; i < layout.lights; ++i)
    for (int axis = 0; axis < 3; ++axis)
      if (scene.lights[i].position == scene.camera.position && basis.differentiates(layout.light_position(i, axis)))
        return scene.lights[i].name;
  return {};
}

const EstimatorOptions& Problem::estimator(Purpose purpose) const {
  auto& known = chosen_.estimator[purpose == Purpose::gradients];
  if (!known) {
    EstimatorOptions options = experiment_.estimator;
    const std::vector<double> theta = parameters_->initial();
    const Scene scene = parameters_->apply(theta);
    const TangentBasis basis = parameters_->tangent(theta);
    const SampleSpec& samples = experiment_.samples;
    const double interior = samples.interior, one = std::max(1.0, interior);
    Job job{0, interior, samples.visibility / one, samples.path_length / one};
    if (purpose == Purpose::gradients) {
      const double images = by_differences() ? 1 + 2 * parameters_->size() : 1;
      job.image = evaluations_ * images * samples.primal;
      job.interior *= evaluations_;
      if (!experiment_.target.measured()) job.image += experiment_.target.samples;
    }
    options.mix =
        measure_mix(scene, gates_, guided(options, samples.visibility), &basis, stream(Pass::mix), purpose, job);
    known = options;
  }
  return *known;
}

const EstimatorOptions& Problem::image_estimator() const {
  if (!chosen_.image_estimator) {
    EstimatorOptions options = experiment_.estimator;
    options.mix = measure_mix(parameters_->apply(parameters_->initial()), gates_, options, nullptr, stream(Pass::mix),
                              Purpose::images, {double{1} * experiment_.samples.primal, 0});
    chosen_.image_estimator = options;
  }
  return *chosen_.image_estimator;
}

void Problem::choose(const SampleSpec& samples, std::uint64_t seed, int evaluations) {
  constexpr std::size_t kMostChoices = 16;
  const Choice choice{{samples.primal, samples.interior, samples.visibility, samples.path_length}, seed, evaluations};
  if (choice == choice_) return;
  if (chosen_before_.size() >= kMostChoices) chosen_before_.clear();
  chosen_before_[choice_] = std::move(chosen_);
  chosen_ = std::move(chosen_before_[choice]);
  choice_ = choice;
  experiment_.samples = samples;
  experiment_.seed = seed;
  evaluations_ = evaluations;
  if (const CasterUpdate update = caster_update(experiment_, scene_); update != caster_update_) {
    caster_update_ = update;
    cache_ = std::make_unique<SceneCache>(scene_, update);
  }
}

void Problem::require_parameters() const {
  if (experiment_.parameters.empty())
    throw InputError(experiment_.file + ": parameters: there is none (at least one is needed here)");
}

bool Problem::can_render(const std::vector<double>& theta) const {
  return coordinates_fit(parameters_->apply(theta));
}

Evaluation Problem::no_evaluation(const GatedImage& target) const {
  constexpr double kNothing = std::numeric_limits<double>::quiet_NaN();
  Evaluation result;
  result.image = target;
  std::fill(result.image.data.begin(), result.image.data.end(), kNothing);
  result.loss = result.mean_squared_error = std::numeric_limits<double>::infinity();
  result.gradient.assign(static_cast<std::size_t>(parameters_->size()), kNothing);
  return result;
}

GatedImage Problem::blank() const {
  return GatedImage(scene_.camera.width, scene_.camera.height, gates_.size(), scene_.grey ? 1 : 3);
}

GatedImage Problem::render(const std::vector<double>& theta, const Stream& stream, SampleRange range) const {
  if (!can_render(theta))
    throw InputError(fmt::format("{}: a vertex would be rendered too far away (allowed: coordinates of at most {})",
                                 experiment_.file, kLargestCoordinate));
  const Scene scene = parameters_->apply(theta);
  return renderer(scene, estimator()).render(stream, range);
}

Renderer Problem::renderer(const Scene& scene, const EstimatorOptions& options, const TangentBasis* basis) const {
  return Renderer(scene, gates_, options, basis, cache_.get());
}

void Problem::require_usable(const GatedImage& target, const std::string& what) const {
  if (experiment_.loss.kind == LossKind::poisson) require_counts(target, readings_, what);
}

ReadingLoss Problem::reading_loss(const GatedImage& target) const {
  constexpr double kLeastMean = 0.02;  // see loss.h
  const LossSpec& loss = experiment_.loss;
  if (loss.kind == LossKind::squared) return {LossKind::squared, 0, readings_};
  const double scale = loss.kind == LossKind::poisson ? kLeastMean * typical_power(target, readings_, 1)
                                                      : loss.scale * std::sqrt(typical_power(target, readings_, 2));
  return scale > 0 ? ReadingLoss{loss.kind, scale, readings_} : ReadingLoss{LossKind::squared, 0, readings_};
}

PenaltyScale Problem::penalty_scale(const GatedImage& target) const {
  if (penalty_.empty()) return {};
  return {mean_square(target, readings_), 1 / readings_.count(target)};
}

LossEstimate Problem::loss(const SplitImage& image, const GatedImage& target, const std::vector<double>& theta) const {
  return loss(image, target, theta, reading_loss(target));
}

LossEstimate Problem::loss(const SplitImage& image, const GatedImage& target, const std::vector<double>& theta,
                           const ReadingLoss& rho) const {
  LossEstimate estimate = estimate_loss(image, target, rho);
  if (!penalty_.empty()) estimate.value += penalty_.value(theta, penalty_scale(target));
  return estimate;
}

EstimatorOptions Problem::estimator(int visibility_samples, Purpose purpose) const {
  return guided(estimator(purpose), visibility_samples);
}

EstimatorOptions Problem::guided(EstimatorOptions options, int visibility_samples) const {
  constexpr double kLearningShare = 0.06;
  if (experiment_.guiding) options.guiding_samples = kLearningShare * visibility_samples;
  return options;
}

}  // namespace isochron
