// What iterations ask of a Problem: losses with their gradients, and products with the transposed Jacobian.
#include <algorithm>

#include "core/base/parallel.h"
#include "optim/problem/loss.h"
#include "optim/problem/problem.h"

namespace isochron {

Evaluation Problem::evaluate(const std::vector<double>& theta, const GatedImage& target, std::uint32_t iteration,
                             Share share, std::vector<std::vector<double>>* parts) const {
  const SampleSpec& samples = experiment_.samples;
  Scene scene = parameters_->apply(theta);
  if (!coordinates_fit(scene)) return no_evaluation(target);
  ReadingLoss rho = reading_loss(target);
  // Estimates about the end of a run have numbers beyond those of iterations, and all histograms.
  if (redraws_histograms() && iteration <= kMostIterations + 1u) {
    rho.readings = drawn_readings(iteration);
    scene.capture->left_out = rho.readings.left_out();
  }
  const TangentBasis basis = parameters_->tangent(theta);
  const Renderer renderer = this->renderer(scene, estimator(share.of(samples.visibility).count()), &basis);
  Evaluation result;
  const bool differences = experiment_.gradient.method == GradientMethod::finite_difference;
  const auto terms = std::count_if(std::begin(kTerms), std::end(kTerms), [&](Term t) { return samples.term(t) > 0; });
  ProgressStage stage("evaluating the loss", 1 + (differences ? parameters_->size() : static_cast<int>(terms)));
  SplitImage image = render_halves(renderer, stream(Pass::primal, iteration), share.of(samples.primal));
  set_loss(loss(image, target, theta, rho), result);
  const GatedImage adjoint = loss_adjoint(image, target, rho);
  stage.advance();
  result.image = std::move(image.image);
  if (differences) {
    if (parts) parts->assign(kGradientParts, std::vector<double>(parameters_->size(), 0.0));
    for (int i = 0; i < parameters_->size(); ++i) {
      const GatedImage derivative =
          finite_difference(theta, i, stream(Pass::finite_difference, iteration), share.of(samples.primal));
      result.gradient.push_back(inner_product(adjoint, derivative));
      stage.advance();
      const std::size_t values = derivative.data.size() / derivative.pixels();
      for (std::size_t k = 0; parts && k < derivative.data.size(); ++k)
        (*parts)[k / values % kGradientParts][i] += adjoint.data[k] * derivative.data[k];
    }
    penalty_.add_gradient(theta, penalty_scale(target), result.gradient);
    return result;
  }
  std::vector<double> dof_gradient(DofLayout(scene).size(), 0.0);
  for (Term term : kTerms) {
    const SampleRange range = share.of(samples.term(term));
    if (range.count() == 0) continue;
    std::vector<std::vector<double>> of_term;
    renderer.add_gradient(term, adjoint, stream(pass_of(term), iteration), range, dof_gradient,
                          parts ? &of_term : nullptr);
    if (parts) parts->insert(parts->end(), of_term.begin(), of_term.end());
    stage.advance();
  }
  result.gradient = basis.transpose_apply(dof_gradient);
  penalty_.add_gradient(theta, penalty_scale(target), result.gradient);
  return result;
}

std::vector<std::vector<double>> Problem::transpose_apply(const std::vector<double>& theta,
                                                          std::span<const GatedImage> images,
                                                          std::uint32_t iteration) const {
  const SampleSpec& samples = experiment_.samples;
  const bool differences = experiment_.gradient.method == GradientMethod::finite_difference;
  const auto terms = std::count_if(std::begin(kTerms), std::end(kTerms), [&](Term t) { return samples.term(t) > 0; });
  ProgressStage stage("differentiating", differences ? parameters_->size() : static_cast<int>(terms));
  std::vector<std::vector<double>> products(images.size());
  if (differences) {
    for (int i = 0; i < parameters_->size(); ++i) {
      const GatedImage difference =
          finite_difference(theta, i, stream(Pass::finite_difference, iteration), {0, samples.primal});
      for (std::size_t k = 0; k < images.size(); ++k) products[k].push_back(inner_product(images[k], difference));
      stage.advance();
    }
    return products;
  }
  const Scene scene = parameters_->apply(theta);
  const TangentBasis basis = parameters_->tangent(theta);
  const Renderer renderer = this->renderer(scene, estimator(samples.visibility), &basis);
  std::vector<std::vector<double>> dof_gradients(images.size(), std::vector<double>(DofLayout(scene).size(), 0.0));
  for (Term term : kTerms) {
    if (samples.term(term) == 0) continue;
    renderer.add_gradients(term, images, stream(pass_of(term), iteration), {0, samples.term(term)}, dof_gradients);
    stage.advance();
  }
  for (std::size_t k = 0; k < images.size(); ++k) products[k] = basis.transpose_apply(dof_gradients[k]);
  return products;
}

GatedImage Problem::finite_difference(const std::vector<double>& theta, int component, const Stream& stream,
                                      SampleRange range) const {
  std::vector<double> above = theta, below = theta;
  const double step = experiment_.gradient.step;
  above[component] = std::min(theta[component] + step, parameters_->upper()[component]);
  below[component] = std::max(theta[component] - step, parameters_->lower()[component]);
  GatedImage difference = render(above, stream, range);
  Stream of_lower = stream;
  if (!experiment_.gradient.common_numbers) of_lower.pass = pass_number(Pass::other_side);
  const GatedImage lower = render(below, of_lower, range);
  const double distance = above[component] - below[component];
  for (std::size_t i = 0; i < difference.data.size(); ++i)
    difference.data[i] = (difference.data[i] - lower.data[i]) / distance;
  return difference;
}

}  // namespace isochron
