#include "optim/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/math/error.h"
#include "core/scene/scene_loader.h"
#include "optim/loss.h"

namespace isochron {
namespace {

Scene load_scene_at(const Experiment& experiment) {
  Scene scene = load_scene(experiment.scene);
  if (experiment.resolution[0] > 0) {
    scene.camera.width = experiment.resolution[0];
    scene.camera.height = experiment.resolution[1];
  }
  return scene;
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

void ImageMean::add(const GatedImage& image, int samples) {
  if (samples_ == 0) sum_ = GatedImage(image.width, image.height, image.gates, image.channels);
  for (std::size_t i = 0; i < image.data.size(); ++i) sum_.data[i] += samples * image.data[i];
  samples_ += samples;
}

GatedImage ImageMean::mean() const {
  GatedImage mean = sum_;
  for (double& value : mean.data) value /= static_cast<double>(samples_);
  return mean;
}

Problem::Problem(Experiment experiment)
    : experiment_(std::move(experiment)),
      scene_(load_scene_at(experiment_)),
      gates_(make_gates(experiment_.gates)),
      parameters_(std::make_unique<Parameters>(scene_, experiment_.parameters)) {}

void Problem::require_parameters() const {
  if (experiment_.parameters.empty())
    throw InputError(experiment_.file + ": parameters: there is none (at least one is needed here)");
}

GatedImage Problem::render(const std::vector<double>& theta, const Stream& stream, SampleRange range) const {
  const Scene scene = parameters_->apply(theta);
  return Renderer(scene, gates_, experiment_.estimator).render(stream, range);
}

GatedImage Problem::read_target(const std::string& file) const {
  GatedImage image = read_exr(file);
  const GatedImage wanted(scene_.camera.width, scene_.camera.height, gates_.size(), scene_.grey ? 1 : 3);
  const auto shape = [](const GatedImage& i) {
    return fmt::format("{} x {} pixels, {} gates, {} channels", i.width, i.height, i.gates, i.channels);
  };
  if (!image.same_shape(wanted))
    throw InputError(
        fmt::format("{}: target images have {}; the experiment has {}", file, shape(image), shape(wanted)));
  return image;
}

GatedImage Problem::make_target(const Poll& poll) const {
  const TargetSpec& target = experiment_.target;
  if (!target.images.empty()) return read_target(target.images);
  // Rendered in parts so that a request to stop does not wait for thousands of samples per pixel.
  const int parts = std::min(32, target.samples);
  const Stream stream{target.seed, 0, pass_number(Pass::target)};
  const Scene scene = parameters_->apply(parameters_->target());
  EstimatorOptions estimator = experiment_.estimator;
  estimator.max_bounces = target.max_bounces;
  const Renderer renderer(scene, gates_, estimator);
  ImageMean mean;
  for (int i = 0; i < parts; ++i) {
    const SampleRange range = Share{i, parts}.of(target.samples);
    mean.add(renderer.render(stream, range), range.count());
    poll();
  }
  return mean.mean();
}

EstimatorOptions Problem::estimator(int visibility_samples) const {
  constexpr double kLearningShare = 0.06;
  EstimatorOptions options = experiment_.estimator;
  if (experiment_.guiding) options.guiding_samples = kLearningShare * visibility_samples;
  return options;
}

Evaluation Problem::evaluate(const std::vector<double>& theta, const GatedImage& target,
                             std::uint32_t iteration, const Poll& poll, Share share) const {
  const SampleSpec& samples = experiment_.samples;
  const Scene scene = parameters_->apply(theta);
  const TangentBasis basis = parameters_->tangent(theta);
  const Renderer renderer(scene, gates_, estimator(share.of(samples.visibility).count()), &basis);
  Evaluation result;
  result.image = renderer.render(stream(Pass::primal, iteration), share.of(samples.primal));
  result.loss = mean_squared_error(result.image, target);
  const GatedImage adjoint = loss_adjoint(result.image, target);
  poll();
  if (experiment_.gradient.method == GradientMethod::finite_difference) {
    for (int i = 0; i < parameters_->size(); ++i) {
      const GatedImage derivative =
          finite_difference(theta, i, stream(Pass::finite_difference, iteration), share.of(samples.primal));
      result.gradient.push_back(inner_product(adjoint, derivative));
      poll();
    }
    return result;
  }
  std::vector<double> dof_gradient(DofLayout(scene).size(), 0.0);
  for (Term term : kTerms) {
    const SampleRange range = share.of(samples.term(term));
    if (range.count() == 0) continue;
    renderer.add_gradient(term, adjoint, stream(pass_of(term), iteration), range, dof_gradient);
    poll();
  }
  result.gradient = basis.transpose_apply(dof_gradient);
  return result;
}

GatedImage Problem::finite_difference(const std::vector<double>& theta, int component, const Stream& stream,
                                      SampleRange range) const {
  std::vector<double> above = theta, below = theta;
  const double step = experiment_.gradient.step;
  above[component] = std::min(theta[component] + step, parameters_->upper()[component]);
  below[component] = std::max(theta[component] - step, parameters_->lower()[component]);
  GatedImage difference = render(above, stream, range);
  const GatedImage lower = render(below, stream, range);
  const double distance = above[component] - below[component];
  for (std::size_t i = 0; i < difference.data.size(); ++i)
    difference.data[i] = (difference.data[i] - lower.data[i]) / distance;
  return difference;
}

}  // namespace isochron
