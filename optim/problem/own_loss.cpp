#include "optim/problem/own_loss.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "core/base/error.h"

namespace isochron {
namespace {

void add(ImageLoss& sum, double factor, const ImageLoss& term) {
  sum.value += factor * term.value;
  for (std::size_t i = 0; i < sum.adjoint.data.size(); ++i) sum.adjoint.data[i] += factor * term.adjoint.data[i];
}

/// Standard error of a loss with this derivative. Values of one pixel are taken as correlated, pixels as independent.
double standard_error_of(const GatedImage& adjoint, const SplitImage& image) {
  const std::size_t values = adjoint.data.size() / adjoint.pixels();
  double variance = 0;
  for (std::size_t begin = 0; begin < adjoint.data.size(); begin += values) {
    double sum = 0;
    for (std::size_t i = begin; i < begin + values; ++i) sum += adjoint.data[i] * image.difference.data[i];
    variance += sum * sum;
  }
  return std::sqrt(image.first * (1 - image.first) * variance);
}

}  // namespace

bool has_target(const Problem& problem) {
  return problem.experiment().target.measured() || problem.parameters().target_known();
}

void require_for_own_loss(const Problem& problem) {
  const Experiment& experiment = problem.experiment();
  const auto refuse = [&](const std::string& key, const std::string& allowed) {
    throw InputError(fmt::format("{}: {}: not with a loss of one's own (allowed: {})", experiment.file, key, allowed));
  };
  const OptimizerMethod method = experiment.optimizer.method;
  if (method != OptimizerMethod::adam && method != OptimizerMethod::lbfgs)
    refuse("optimizer.method: " + std::string(name_of(method)), "adam, lbfgs");
  for (const ParameterSpec& spec : experiment.parameters) {
    if (spec.remesh.levels > 0) refuse(spec.name + ": remesh", "a mesh that stays as it is");
    if (spec.slopes > 0 || spec.bends() || spec.prior_width > 0)
      refuse(spec.name + ": slopes, bending, variation and prior_width", "diffusion");
  }
}

ImageLoss OwnLossObjective::unbiased(const SplitImage& image) const {
  GatedImage halves[2] = {image.image, image.image};
  for (std::size_t i = 0; i < image.image.data.size(); ++i) {
    halves[0].data[i] += (1 - image.first) * image.difference.data[i];
    halves[1].data[i] -= image.first * image.difference.data[i];
  }
  ImageLoss found = loss_(image.image);
  add(found, 1, found);
  add(found, -image.first, loss_(halves[0]));
  add(found, image.first - 1, loss_(halves[1]));
  return found;
}

double OwnLossObjective::loss(const std::vector<double>& theta, std::uint32_t iteration) const {
  if (!problem().can_render(theta)) return std::numeric_limits<double>::infinity();
  return unbiased(render(theta, iteration)).value;
}

Evaluation OwnLossObjective::evaluate(const std::vector<double>& theta, std::uint32_t iteration) const {
  if (!problem().can_render(theta)) return problem().no_evaluation(problem().blank());
  ProgressStage stage("evaluating the loss", 2);
  SplitImage image = render(theta, iteration);
  stage.advance();
  const ImageLoss found = unbiased(image);
  Evaluation result;
  result.loss = found.value;
  result.loss_noise = standard_error_of(found.adjoint, image);
  result.mean_squared_error = result.mean_squared_error_noise = std::numeric_limits<double>::quiet_NaN();
  if (has_target(problem())) {
    const LossEstimate squares = estimate_loss(image, target(), {.readings = problem().readings()});
    result.mean_squared_error = squares.mean_squared_error;
    result.mean_squared_error_noise = squares.mean_squared_error_noise;
  }
  result.gradient = problem().transpose_apply(theta, found.adjoint, iteration);
  result.image = std::move(image.image);
  return result;
}

Evaluation OwnLossObjective::evaluate_part(const std::vector<double>& theta, std::uint32_t iteration, int) const {
  return evaluate(theta, iteration);
}

Evaluation OwnLossObjective::linearise(const std::vector<double>&, std::uint32_t) const {
  throw std::logic_error("a loss of one's own has no curvature");
}

std::vector<std::vector<double>> OwnLossObjective::probe_curvature(const std::vector<double>&, std::uint32_t,
                                                                   const Evaluation&, Probes) const {
  throw std::logic_error("a loss of one's own has no curvature");
}

}  // namespace isochron
