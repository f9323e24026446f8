#include "optim/problem/rendered_curvature.h"

#include <utility>

#include "optim/problem/jacobian.h"
#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

/// Random numbers of what is asked at a run's end: no run has so many iterations.
constexpr std::uint32_t kProductsIteration = kMostIterations + 2u, kMatrixIteration = kMostIterations + 3u;

/// Of the diagonal, which preconditions: each knows an entry to a factor of about 1 +- sqrt(2 / 12).
constexpr int kProbes = 12;

}  // namespace

RenderedCurvature::RenderedCurvature(const Problem& problem, const GatedImage& target, const std::vector<double>& theta,
                                     const Poll& poll)
    : problem_(problem),
      theta_(theta),
      poll_(poll),
      penalty_scale_(problem.penalty_scale(target)),
      scene_(problem.parameters().apply(theta)),
      basis_(problem.parameters().tangent(theta)) {
  Evaluation at = problem.evaluate(theta, target, kMatrixIteration, poll);
  weights_ = curvature_weights(at.image, target, problem.reading_loss(target));
  gradient_ = std::move(at.gradient);
  const Parameters& parameters = problem.parameters();
  for (std::size_t i = 0; i < theta.size(); ++i)
    if ((theta[i] <= parameters.lower()[i] && gradient_[i] > 0) ||
        (theta[i] >= parameters.upper()[i] && gradient_[i] < 0))
      gradient_[i] = 0;
}

std::vector<double> RenderedCurvature::diagonal() const {
  std::vector<double> mean(theta_.size(), 0.0);
  for (int probe = 0; probe < kProbes; ++probe) {
    const std::vector<double> found = probe_diagonal(problem_, theta_, weights_, kProductsIteration, probe, poll_);
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += found[i] / kProbes;
  }
  problem_.penalty().add_diagonal(penalty_scale_, mean);
  return mean;
}

std::vector<double> RenderedCurvature::prior_diagonal() const {
  std::vector<double> diagonal(theta_.size(), 0.0);
  problem_.penalty().add_diagonal(penalty_scale_, diagonal);
  return diagonal;
}

Curvatures RenderedCurvature::readings(const TangentBasis& basis, std::uint32_t iteration) const {
  JacobianHalves jacobian = render_jacobian(problem_, theta_, basis, iteration, poll_);
  Evaluation found;
  gauss_newton(jacobian, std::vector<double>(weights_.size(), 0.0), weights_, found);
  return {std::move(found.curvature), std::move(found.curvature_bound), {}};
}

Curvatures RenderedCurvature::all() const {
  Curvatures result = readings(basis_, kMatrixIteration);
  result.prior.resize(result.data.size());
  problem_.penalty().add_curvature(static_cast<int>(theta_.size()), penalty_scale_, result.prior);
  return result;
}

Curvatures RenderedCurvature::within(const std::vector<std::vector<double>>& columns) const {
  Curvatures result = readings(combinations_of(basis_, columns), kMatrixIteration);
  for (const std::vector<double>& a : columns) {
    const std::vector<double> product = prior_product(a);
    for (const std::vector<double>& b : columns) result.prior.push_back(dot(product, b));
  }
  return result;
}

std::vector<double> RenderedCurvature::prior_product(const std::vector<double>& vector) const {
  std::vector<double> product(vector.size(), 0.0);
  problem_.penalty().add_gradient(vector, penalty_scale_, product);  // it is linear
  return product;
}

std::vector<std::vector<double>> RenderedCurvature::products(const std::vector<std::vector<double>>& vectors) const {
  const SampleSpec& samples = problem_.experiment().samples;
  JacobianHalves forward =
      render_jacobian(problem_, theta_, combinations_of(basis_, vectors), kProductsIteration, poll_);
  const Renderer renderer = problem_.renderer(scene_, problem_.estimator(samples.visibility), &basis_);
  std::vector<std::vector<double>> products;
  GatedImage image = problem_.blank();
  for (std::size_t v = 0; v < vectors.size(); ++v) {
    std::vector<double> dof_gradient(DofLayout(scene_).size(), 0.0);
    for (const int half : {0, 1}) {  // what one half of the samples sees, by the other's transpose
      const double* column = forward.half[1 - half].data() + v * forward.residuals;
      for (std::size_t i = 0; i < image.data.size(); ++i) image.data[i] = weights_[i] * column[i] / 2;
      for (const Term term : kTerms) {
        if (samples.term(term) == 0) continue;
        renderer.add_gradient(term, image, problem_.stream(pass_of(term), kProductsIteration),
                              half_of(samples.term(term), half), dof_gradient);
      }
      poll_();
    }
    products.push_back(basis_.transpose_apply(dof_gradient));
    const std::vector<double> prior = prior_product(vectors[v]);
    for (std::size_t i = 0; i < prior.size(); ++i) products.back()[i] += prior[i];
  }
  return products;
}

}  // namespace isochron
