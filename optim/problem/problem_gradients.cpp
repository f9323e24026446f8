// What iterations ask of a Problem: losses with their gradients, and products with the transposed Jacobian.
#include <algorithm>
#include <utility>

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
  // Estimates about the end of a run, whose numbers are beyond those of iterations, are of the histograms that were chosen first.
  if (redraws_histograms() && iteration <= kMostIterations + 1u) {
    rho.readings = drawn_readings(iteration);
    scene.capture->left_out = rho.readings.left_out();
  }
  const TangentBasis basis = parameters_->tangent(theta);
  const Renderer renderer = this->renderer(scene, estimator(share.of(samples.visibility).count()), &basis);
  Evaluation result;
  ProgressStage stage("evaluating the loss", 1 + gradient_steps());
  SplitImage image = render_halves(renderer, stream(Pass::primal, iteration), share.of(samples.primal));
  set_loss(loss(image, target, theta, rho), result);
  const GatedImage adjoint = loss_adjoint(image, target, rho);
  stage.advance();
  result.image = std::move(image.image);
  const std::span<const GatedImage> adjoints(&adjoint, 1);
  result.gradient =
      std::move((by_differences() ? apply_differences(theta, adjoints, iteration, share, stage, parts)
                                  : apply_terms(renderer, basis, adjoints, iteration, share, stage, parts))[0]);
  penalty_.add_gradient(theta, penalty_scale(target), result.gradient);
  return result;
}

std::vector<std::vector<double>> Problem::transpose_apply(const std::vector<double>& theta,
                                                          std::span<const GatedImage> images,
                                                          std::uint32_t iteration) const {
  ProgressStage stage("differentiating", gradient_steps());
  if (by_differences()) return apply_differences(theta, images, iteration, {}, stage);
  const Scene scene = parameters_->apply(theta);
  const TangentBasis basis = parameters_->tangent(theta);
  const Renderer renderer = this->renderer(scene, estimator(experiment_.samples.visibility), &basis);
  return apply_terms(renderer, basis, images, iteration, {}, stage);
}

std::vector<std::vector<double>> Problem::apply_differences(const std::vector<double>& theta,
                                                            std::span<const GatedImage> images, std::uint32_t iteration,
                                                            Share share, ProgressStage& stage,
                                                            std::vector<std::vector<double>>* parts) const {
  std::vector<std::vector<double>> products(images.size());
  if (parts) parts->assign(kGradientParts, std::vector<double>(parameters_->size(), 0.0));
  for (int i = 0; i < parameters_->size(); ++i) {
    const GatedImage difference =
        finite_difference(theta, i, stream(Pass::finite_difference, iteration), share.of(experiment_.samples.primal));
    for (std::size_t k = 0; k < images.size(); ++k) products[k].push_back(inner_product(images[k], difference));
    const std::size_t values = difference.data.size() / difference.pixels();
    for (std::size_t k = 0; parts && k < difference.data.size(); ++k)
      (*parts)[k / values % kGradientParts][i] += images[0].data[k] * difference.data[k];
    stage.advance();
  }
  return products;
}

std::vector<std::vector<double>> Problem::apply_terms(const Renderer& renderer, const TangentBasis& basis,
                                                      std::span<const GatedImage> images, std::uint32_t iteration,
                                                      Share share, ProgressStage& stage,
                                                      std::vector<std::vector<double>>* parts) const {
  std::vector<std::vector<double>> dof_gradients(images.size(), std::vector<double>(basis.row_begin.size() - 1, 0.0));
  for (const Term term : kTerms) {
    const SampleRange range = share.of(experiment_.samples.term(term));
    if (range.count() == 0) continue;
    std::vector<std::vector<double>> of_term;
    renderer.add_gradients(term, images, stream(pass_of(term), iteration), range, dof_gradients,
                           parts ? &of_term : nullptr);
    if (parts) parts->insert(parts->end(), of_term.begin(), of_term.end());
    stage.advance();
  }
  std::vector<std::vector<double>> products;
  for (const std::vector<double>& dof_gradient : dof_gradients) products.push_back(basis.transpose_apply(dof_gradient));
  return products;
}

bool Problem::by_differences() const {
  return experiment_.gradient.method == GradientMethod::finite_difference;
}

int Problem::gradient_steps() const {
  const auto has = [&](Term term) { return experiment_.samples.term(term) > 0; };
  return by_differences() ? parameters_->size() : static_cast<int>(std::ranges::count_if(kTerms, has));
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
