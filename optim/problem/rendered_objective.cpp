#include "optim/problem/rendered_objective.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/error.h"
#include "optim/problem/gauss_newton.h"
#include "optim/problem/jacobian.h"
#include "optim/problem/loss.h"

namespace isochron {

namespace {

void require_jacobian_fits(const Problem& problem) {
  if (problem.experiment().optimizer.method != OptimizerMethod::levenberg_marquardt) return;
  const double residuals = residual_count(problem), unknowns = problem.parameters().size();
  const double bytes = linearisation_bytes(problem, unknowns);
  if (bytes > kMostLinearisationBytes)
    throw InputError(fmt::format(
        "{}: optimizer.method: levenberg_marquardt needs {:.3g} GB for the Jacobian of {:.0f} residuals by {} "
        "unknowns (allowed: {} GB; adam and lbfgs need no Jacobian)",
        problem.experiment().file, bytes / 1e9, residuals, unknowns, kMostLinearisationBytes / 1e9));
}

}  // namespace

void require_two_samples(const Problem& problem) {
  if (problem.experiment().samples.primal < 2)
    throw InputError(fmt::format(
        "{}: samples.primal: 1 is too few: the loss comes from two independent halves of the samples (allowed: at "
        "least 2)",
        problem.experiment().file));
}

void require_optimisable(const Problem& problem) {
  problem.require_parameters();
  require_two_samples(problem);
  require_jacobian_fits(problem);
}

SplitImage RenderedObjective::render(const std::vector<double>& theta, std::uint32_t iteration) const {
  const Scene scene = problem_.parameters().apply(theta);
  const Renderer renderer = problem_.renderer(scene, problem_.estimator());
  return render_halves(renderer, problem_.stream(Pass::primal, iteration), {0, problem_.experiment().samples.primal});
}

double RenderedObjective::loss(const std::vector<double>& theta, std::uint32_t iteration) const {
  if (!problem_.can_render(theta)) return std::numeric_limits<double>::infinity();
  return problem_.loss(render(theta, iteration), target_, theta).value;
}

Evaluation RenderedObjective::evaluate(const std::vector<double>& theta, std::uint32_t iteration) const {
  return problem_.evaluate(theta, target_, iteration);
}

Evaluation RenderedObjective::evaluate_part(const std::vector<double>& theta, std::uint32_t iteration,
                                            int parts) const {
  const SampleSpec& samples = problem_.experiment().samples;
  int most = samples.primal / 2;
  for (const Term term : kTerms)
    if (samples.term(term) > 0) most = std::min(most, samples.term(term));
  return problem_.evaluate(theta, target_, iteration, {0, std::clamp(parts, 1, std::max(1, most))});
}

Evaluation RenderedObjective::linearise(const std::vector<double>& theta, std::uint32_t iteration) const {
  if (!problem_.can_render(theta)) return problem_.no_evaluation(target_);
  const ReadingLoss rho = problem_.reading_loss(target_);
  SplitImage image = render(theta, iteration);
  Evaluation result;
  set_loss(problem_.loss(image, target_, theta), result);

  JacobianHalves jacobian = render_jacobian(problem_, theta, problem_.parameters().tangent(theta), iteration);
  gauss_newton(jacobian, loss_adjoint(image, target_, rho).data, curvature_weights(image.image, target_, rho), result);
  result.image = std::move(image.image);
  const PenaltyScale scale = problem_.penalty_scale(target_);
  const int unknowns = static_cast<int>(theta.size());
  problem_.penalty().add_gradient(theta, scale, result.gradient);
  problem_.penalty().add_curvature(unknowns, scale, result.curvature);
  problem_.penalty().add_curvature(unknowns, scale, result.curvature_bound);
  return result;
}

std::vector<std::vector<double>> RenderedObjective::probe_curvature(const std::vector<double>& theta,
                                                                    std::uint32_t iteration, const Evaluation& now,
                                                                    Probes probes) const {
  std::vector<std::vector<double>> diagonals = probe_diagonals(
      problem_, theta, curvature_weights(now.image, target_, problem_.reading_loss(target_)), iteration, probes);
  for (std::vector<double>& diagonal : diagonals)
    problem_.penalty().add_diagonal(problem_.penalty_scale(target_), diagonal);
  return diagonals;
}

std::vector<Coupling> RenderedObjective::couplings() const {
  return problem_.penalty().couplings(problem_.penalty_scale(target_));
}

}  // namespace isochron
