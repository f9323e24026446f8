#include "optim/problem/rendered_objective.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "optim/problem/gauss_newton.h"
#include "optim/problem/loss.h"

namespace isochron {
namespace {

/// Bytes of derivative images, and of partial sums of the renderer's work partitions (about 8), that are alive at a time.
constexpr double kGroupBytes = 1e9, kImagesPerUnknown = 8 + 2;

/// Matrices of unknowns x unknowns that one step of Levenberg-Marquardt holds.
constexpr double kSquareMatrices = 8;

/// Adds the derivative images, or central differences, of one half of the samples to the columns of
/// `jacobian`.
void add_half(const Problem& problem, const std::vector<double>& theta, std::uint32_t iteration, int half,
              const Poll& poll, JacobianHalves& jacobian) {
  const SampleSpec& samples = problem.experiment().samples;
  const auto half_of = [&](int count) { return SampleRange{half * ((count + 1) / 2), (half + 1) * ((count + 1) / 2)}; };
  const auto add = [&](int column, const GatedImage& image) {
    double* entry = jacobian.half[half].data() + jacobian.residuals * static_cast<std::size_t>(column);
    for (double value : image.data) *entry++ += value;
  };
  const int unknowns = static_cast<int>(theta.size());
  if (problem.experiment().gradient.method == GradientMethod::finite_difference) {
    for (int i = 0; i < unknowns; ++i) {
      add(i, problem.finite_difference(theta, i, problem.stream(Pass::finite_difference, iteration),
                                       half_of(samples.primal)));
      poll();
    }
    return;
  }
  const Scene scene = problem.parameters().apply(theta);
  const TangentBasis all = problem.parameters().tangent(theta);
  const double bytes = 8.0 * static_cast<double>(jacobian.residuals) * kImagesPerUnknown;
  const int group = std::max(1, static_cast<int>(std::min(kGroupBytes / bytes, 1e6)));
  for (int first = 0; first < unknowns; first += group) {
    const TangentBasis basis = select_columns(all, first, std::min(group, unknowns - first));
    const Renderer renderer = problem.renderer(scene, problem.estimator(samples.visibility), &basis);
    for (Term term : kTerms) {
      if (samples.term(term) == 0) continue;
      const auto images = renderer.derive(term, problem.stream(pass_of(term), iteration), half_of(samples.term(term)));
      for (int i = 0; i < basis.columns; ++i) add(first + i, images[i]);
      poll();
    }
  }
}

}  // namespace

void require_jacobian_fits(const Problem& problem) {
  if (problem.experiment().optimizer.method != OptimizerMethod::levenberg_marquardt) return;
  const Camera& camera = problem.scene().camera;
  const double residuals = 1.0 * camera.width * camera.height * problem.gates().size() * (problem.scene().grey ? 1 : 3);
  const double unknowns = problem.parameters().size();
  const double bytes = 8 * (2 * residuals * unknowns + kSquareMatrices * unknowns * unknowns);
  if (bytes > kMostLinearisationBytes)
    throw InputError(fmt::format(
        "{}: optimizer.method: levenberg_marquardt needs {:.3g} GB for the Jacobian of {:.0f} residuals by {} "
        "unknowns (allowed: {} GB; adam and lbfgs need no Jacobian)",
        problem.experiment().file, bytes / 1e9, residuals, unknowns, kMostLinearisationBytes / 1e9));
}

void require_two_samples(const Problem& problem) {
  if (problem.experiment().samples.primal < 2)
    throw InputError(fmt::format(
        "{}: samples.primal: 1 is too few: the loss comes from two independent halves of the samples (allowed: at "
        "least 2)",
        problem.experiment().file));
}

SplitImage RenderedObjective::render(const std::vector<double>& theta, std::uint32_t iteration) const {
  const Scene scene = problem_.parameters().apply(theta);
  const Renderer renderer = problem_.renderer(scene, problem_.estimator());
  SplitImage image =
      render_halves(renderer, problem_.stream(Pass::primal, iteration), {0, problem_.experiment().samples.primal});
  poll_();
  return image;
}

double RenderedObjective::loss(const std::vector<double>& theta, std::uint32_t iteration) const {
  if (!problem_.can_render(theta)) return std::numeric_limits<double>::infinity();
  return problem_.loss(render(theta, iteration), target_, theta).value;
}

Evaluation RenderedObjective::evaluate(const std::vector<double>& theta, std::uint32_t iteration) const {
  return problem_.evaluate(theta, target_, iteration, poll_);
}

Evaluation RenderedObjective::linearise(const std::vector<double>& theta, std::uint32_t iteration) const {
  if (!problem_.can_render(theta)) return problem_.no_evaluation(target_);
  const ReadingLoss rho = problem_.reading_loss(target_);
  SplitImage image = render(theta, iteration);
  Evaluation result;
  set_loss(problem_.loss(image, target_, theta), result);

  JacobianHalves jacobian(target_.data.size(), theta.size());
  for (int half : {0, 1}) add_half(problem_, theta, iteration, half, poll_, jacobian);
  gauss_newton(jacobian, loss_adjoint(image, target_, rho).data, curvature_weights(image.image, target_, rho), result);
  result.image = std::move(image.image);
  const PenaltyScale scale = problem_.penalty_scale(target_);
  const int unknowns = static_cast<int>(theta.size());
  problem_.penalty().add_gradient(theta, scale, result.gradient);
  problem_.penalty().add_curvature(unknowns, scale, result.curvature);
  problem_.penalty().add_curvature(unknowns, scale, result.curvature_bound);
  return result;
}

std::vector<double> RenderedObjective::probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                       const Evaluation& now, int probe) const {
  GatedImage signs = now.image;
  signs.data = curvature_weights(now.image, target_, problem_.reading_loss(target_));
  for (std::size_t i = 0; i < signs.data.size(); ++i) {
    Rng rng(problem_.stream(Pass::probe, iteration), i, static_cast<std::uint32_t>(probe));
    signs.data[i] = std::copysign(std::sqrt(signs.data[i]), rng.uniform() - 0.5);
  }
  std::vector<double> diagonal = problem_.transpose_apply(theta, signs, iteration, poll_);
  for (double& d : diagonal) d *= d;
  problem_.penalty().add_diagonal(problem_.penalty_scale(target_), diagonal);
  return diagonal;
}

}  // namespace isochron
