#include "optim/problem/rendered_curvature.h"

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/parallel.h"
#include "optim/problem/conjugate_gradients.h"
#include "optim/problem/jacobian.h"
#include "optim/problem/metric.h"
#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

/// Random numbers of what is asked at a run's end: no run has so many iterations.
constexpr std::uint32_t kProductsIteration = kMostIterations + 2u, kMatrixIteration = kMostIterations + 3u;

/// Their scatter is known to a factor of about 1 +- 1 / sqrt(10).
constexpr int kGradients = 6;

/// Of what samples solve for, and of their pulls. The noise of one adds eight times as much as the readings determine, of a surface that
/// `isochron reconstruct` finds.
constexpr std::uint32_t kRenderings = 4, kSampleIteration = kMatrixIteration + kGradients,
                        kPullIteration = kSampleIteration + kRenderings;

/// Of a posterior's samples. In tests/optim/evidence_test.cpp, 81 unknowns, twelve steps and 24 give the same trace, 39.4, where the whole
/// matrix has 37.5; six give 36.8.
constexpr int kSampleSteps = 12;

}  // namespace

RenderedCurvature::RenderedCurvature(const Problem& problem, const GatedImage& target, const std::vector<double>& theta)
    : problem_(problem),
      target_(target),
      theta_(theta),
      prior_(problem.prior()),
      smoothing_{problem.penalty_scale(target).slopes, 0},
      priors_{0, problem.penalty_scale(target).priors},
      both_{smoothing_.slopes, priors_.priors},
      scene_(problem.parameters().apply(theta)),
      basis_(problem.parameters().tangent(theta)) {
  Evaluation at = problem.evaluate(theta, target, kMatrixIteration);
  first_gradient_ = std::move(at.gradient);
  weights_ = curvature_weights(at.image, target, problem.reading_loss(target));
}

std::vector<std::vector<double>> RenderedCurvature::gradients() const {
  const Parameters& parameters = problem_.parameters();
  std::vector<std::vector<double>> gradients;
  for (int k = 0; k < kGradients; ++k)
    gradients.push_back(
        within_bounds(k == 0 ? first_gradient_ : problem_.evaluate(theta_, target_, kMatrixIteration + k).gradient,
                      theta_, parameters.lower(), parameters.upper()));
  return gradients;
}

const std::vector<double>& RenderedCurvature::diagonal() const {
  if (!diagonal_.empty()) return diagonal_;
  std::vector<double> mean(theta_.size(), 0.0);
  for (const std::vector<double>& found :
       probe_diagonals(problem_, theta_, weights_, kProductsIteration, {.count = kProbesOfDiagonal}))
    for (std::size_t i = 0; i < mean.size(); ++i) mean[i] += found[i] / kProbesOfDiagonal;
  prior_.add_diagonal(both_, mean);
  return diagonal_ = std::move(mean);
}

std::vector<double> RenderedCurvature::prior_diagonal() const {
  std::vector<double> diagonal(theta_.size(), 0.0);
  prior_.add_diagonal(smoothing_, diagonal);
  return diagonal;
}

Curvatures RenderedCurvature::readings(const TangentBasis& basis, std::uint32_t iteration) const {
  JacobianHalves jacobian = render_jacobian(problem_, theta_, basis, iteration);
  Evaluation found;
  gauss_newton(jacobian, std::vector<double>(weights_.size(), 0.0), weights_, found);
  return {std::move(found.curvature), std::move(found.curvature_bound), {}};
}

Curvatures RenderedCurvature::all() const {
  Curvatures result = readings(basis_, kMatrixIteration);
  result.prior.resize(result.data.size());
  const int unknowns = static_cast<int>(theta_.size());
  prior_.add_curvature(unknowns, smoothing_, result.prior);
  for (std::vector<double>* matrix : {&result.data, &result.bound}) prior_.add_curvature(unknowns, priors_, *matrix);
  return result;
}

Curvatures RenderedCurvature::within(const std::vector<std::vector<double>>& columns) const {
  Curvatures result = readings(combinations_of(basis_, columns), kMatrixIteration);
  std::size_t entry = 0;
  for (const std::vector<double>& a : columns) {
    std::vector<double> smoothing(a.size(), 0.0), priors = smoothing;
    prior_.add_product(smoothing_, a, smoothing);
    prior_.add_product(priors_, a, priors);
    for (const std::vector<double>& b : columns) {
      result.prior.push_back(dot(smoothing, b));
      for (std::vector<double>* matrix : {&result.data, &result.bound}) (*matrix)[entry] += dot(priors, b);
      ++entry;
    }
  }
  return result;
}

std::vector<std::vector<double>> RenderedCurvature::pulls(int count, std::uint32_t first) const {
  std::vector<std::vector<double>> means(count, std::vector<double>(theta_.size(), 0.0));
  for (std::uint32_t rendered = first; rendered < first + kRenderings; ++rendered) {
    const std::vector<std::vector<double>> found =
        probe_readings(problem_, theta_, weights_, kProductsIteration, {kProbesOfDiagonal, count}, rendered);
    for (int k = 0; k < count; ++k)
      for (std::size_t i = 0; i < theta_.size(); ++i) means[k][i] += found[k][i] / kRenderings;
  }
  return means;
}

PosteriorSamples RenderedCurvature::samples(int count) const {
  std::vector<std::vector<double>> gradients = pulls(count, kSampleIteration);
  for (int k = 0; k < count; ++k)
    prior_.add_noise(both_, problem_.stream(Pass::probe, kMatrixIteration),
                     static_cast<std::uint32_t>(kProbesOfDiagonal + k), gradients[k]);
  const std::vector<double>& at_first = diagonal();
  const std::vector<double>&low = problem_.parameters().lower(), &high = problem_.parameters().upper();
  std::vector<std::size_t> free;
  for (std::size_t i = 0; i < theta_.size(); ++i)
    if (at_first[i] > 0 && theta_[i] > low[i] && theta_[i] < high[i]) free.push_back(i);
  return {solve([&](const VectorList& vectors) { return products(vectors); }, gradients,
                preconditioner(std::move(free)), {.most_steps = kSampleSteps, .least_curvature = kAboveNoise}),
          pulls(count, kPullIteration)};
}

ApproximateInverse RenderedCurvature::preconditioner(std::vector<std::size_t> free) const {
  const auto metric = std::make_shared<const Metric>(diagonal(), prior_.couplings(both_), std::move(free));
  return [metric](const std::vector<double>& residual) { return metric->solve(residual); };
}

std::vector<std::vector<double>> RenderedCurvature::products(const std::vector<std::vector<double>>& vectors) const {
  const SampleSpec& samples = problem_.experiment().samples;
  JacobianHalves forward = render_jacobian(problem_, theta_, combinations_of(basis_, vectors), kProductsIteration);
  const Renderer renderer = problem_.renderer(scene_, problem_.estimator(samples.visibility), &basis_);
  std::vector<std::vector<double>> products;
  std::vector<GatedImage> images(std::min<std::size_t>(kAdjointsTogether, vectors.size()), problem_.blank());
  while (products.size() < vectors.size()) {
    const std::size_t done = products.size();
    images.resize(std::min(images.size(), vectors.size() - done));
    std::vector<std::vector<double>> dof_gradients(images.size(), std::vector<double>(DofLayout(scene_).size(), 0.0));
    for (const int half : {0, 1}) {  // what one half of the samples sees, by the other's transpose
      for (std::size_t k = 0; k < images.size(); ++k) {
        const double* column = forward.half[1 - half].data() + (done + k) * forward.residuals;
        parallel_ranges(weights_.size(), [&](std::size_t begin, std::size_t end) {
          for (std::size_t i = begin; i < end; ++i) images[k].data[i] = weights_[i] * column[i] / 2;
        });
      }
      for (const Term term : kTerms) {
        if (samples.term(term) == 0) continue;
        renderer.add_gradients(term, images, problem_.stream(pass_of(term), kProductsIteration),
                               half_of(samples.term(term), half), dof_gradients);
      }
    }
    for (const std::vector<double>& dof_gradient : dof_gradients) {
      products.push_back(basis_.transpose_apply(dof_gradient));
      prior_.add_product(both_, vectors[products.size() - 1], products.back());
    }
  }
  return products;
}

}  // namespace isochron
