#include "optim/run/fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "optim/run/bounds.h"

namespace isochron {
namespace {

SplitImage render_expected(const Problem& problem, const std::vector<double>& theta, int samples, int number) {
  return problem.render_halves_in_parts(theta, problem.estimator(), problem.stream(Pass::histograms, number), samples,
                                        "rendering the expected counts");
}

/// The mean of two images of as many samples each, half by half.
SplitImage mean_of(SplitImage a, const SplitImage& b) {
  const double first = (a.first + b.first) / 2;
  for (std::size_t i = 0; i < a.image.data.size(); ++i) {
    const auto half = [&](const SplitImage& s, double of_difference) {
      return s.image.data[i] + of_difference * s.difference.data[i];
    };
    const double one = (a.first * half(a, 1 - a.first) + b.first * half(b, 1 - b.first)) / (2 * first);
    const double other = ((1 - a.first) * half(a, -a.first) + (1 - b.first) * half(b, -b.first)) / (2 * (1 - first));
    a.image.data[i] = (a.image.data[i] + b.image.data[i]) / 2;
    a.difference.data[i] = one - other;
  }
  a.first = first;
  return a;
}

}  // namespace

bool has_fit(const Problem& problem, const GatedImage& target) {
  return problem.reading_loss(target).kind == LossKind::poisson && are_whole_numbers(target, problem.readings());
}

int fit_samples(const Problem& problem) {
  constexpr int kIterations = 16;
  const Experiment& experiment = problem.experiment();
  const int wanted = std::max(2, experiment.output.histogram_samples), primal = experiment.samples.primal;
  return problem.scene().capture ? wanted : std::max(primal, std::min(wanted, kIterations * primal));
}

std::vector<char> free_unknowns(const Problem& problem, const std::vector<double>& theta) {
  std::vector<char> free(theta.size(), 0);
  for (std::size_t b = 0; b < problem.parameters().blocks().size(); ++b) {
    const Parameters::Block& block = problem.parameters().blocks()[b];
    if (problem.experiment().parameters[b].type == ParameterType::background) continue;
    for (int i = block.begin; i < block.begin + block.count; ++i)
      free[i] = !is_at_bound(problem.parameters(), theta, i);
  }
  return free;
}

GoodnessOfFit judge_fit(const Problem& problem, const std::vector<double>& theta, const SplitImage& image,
                        const GatedImage& target, std::optional<double> determined,
                        const std::optional<DevianceTest>& background) {
  const Scene scene = problem.parameters().apply(theta);
  CountModel model;
  model.image = &image;
  const auto background_of = [&](int pixel) { return scene.detector.background_of(scene.capture, pixel); };
  for (int pixel = 0; pixel < target.pixels(); ++pixel)
    model.background.push_back(scene.detector.background[background_of(pixel)]);
  const std::vector<char> free = free_unknowns(problem, theta);
  model.other_unknowns = determined.value_or(static_cast<double>(std::count(free.begin(), free.end(), 1)));
  for (std::size_t b = 0; b < problem.parameters().blocks().size(); ++b) {
    if (problem.experiment().parameters[b].type != ParameterType::background) continue;
    const Parameters::Block& block = problem.parameters().blocks()[b];
    model.background_free.clear();
    for (int i = block.begin; i < block.begin + block.count; ++i)
      model.background_free.push_back(!is_at_bound(problem.parameters(), theta, i));
    for (int pixel = 0; pixel < target.pixels(); ++pixel)
      model.background_unknown.push_back(block.count == 1 ? 0 : background_of(pixel));
  }
  return judge_fit(model, target, problem.reading_loss(target), background);
}

GoodnessOfFit judge_rendered_fit(const Problem& problem, const std::vector<double>& theta, const GatedImage& target,
                                 SplitImage& image, std::optional<double> determined, int doublings) {
  const int samples = fit_samples(problem);
  image = render_expected(problem, theta, samples, 0);
  GoodnessOfFit fit = judge_fit(problem, theta, image, target, determined);
  for (int i = 0; i < doublings && problem.scene().capture && fit.fit.image_share > kMostImageShare; ++i) {
    image = mean_of(std::move(image), render_expected(problem, theta, samples << i, i + 1));
    fit = judge_fit(problem, theta, image, target, determined, fit.background);
  }
  return fit;
}

bool left_its_data(const GoodnessOfFit& fit, const Checkpoint& state, const LogRow& last) {
  const double noise = std::hypot(last.loss_noise, state.loss_noise_initial);
  return fit.lost() || (fit.verdict() == FitVerdict::unexplained && !fit.fit.is_too_near() && state.iteration > 0 &&
                        last.loss > state.loss_initial + 3 * noise);
}

std::string fit_yaml(const std::optional<GoodnessOfFit>& fit) {
  if (!fit) return {};
  return fmt::format("fit: {{deviance: {}, degrees_of_freedom: {}, floor: {}, p_value: {:.6g}, verdict: {}}}\n",
                     fit->fit.deviance, fit->fit.degrees_of_freedom, fit->fit.floor, fit->fit.p_value,
                     name(fit->verdict()));
}

std::string fit_report(const std::optional<GoodnessOfFit>& fit) {
  if (!fit) return {};
  const DevianceTest& test = fit->fit;
  const std::string numbers = fmt::format("deviance {:.6g}, {:.6g} +- {:.2g} to be expected, p = {:.2g}", test.deviance,
                                          test.floor, test.spread, test.p_value);
  if (fit->lost())
    return fmt::format(
        "  fit: has lost the light of the data ({}); start nearer to where it comes from (captures: the "
        "back-projection in "
        "capture.png shows it)\n",
        numbers);
  switch (fit->verdict()) {
    case FitVerdict::explained:
      return fmt::format("  fit: explains the data ({})\n", numbers);
    case FitVerdict::unexplained:
      return fmt::format("  fit: does not explain the data ({}{})\n", numbers,
                         test.is_too_near() ? ": no Poisson numbers, or not at rest" : "");
    case FitVerdict::no_signal:
      break;
  }
  return fmt::format("  fit: no signal, background alone explains the data ({})\n", numbers);
}

}  // namespace isochron
