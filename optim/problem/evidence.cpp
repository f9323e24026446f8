#include "optim/problem/evidence.h"

#include <algorithm>
#include <cmath>

#include "optim/problem/rendered_curvature.h"

namespace isochron {
std::vector<double> evidence_factors(const Problem& problem, const GatedImage& target,
                                     const std::vector<double>& theta) {
  const std::vector<ParameterSpec>& specs = problem.experiment().parameters;
  std::vector<double> factors(specs.size(), 1.0);
  const Poll poll = [] {};
  const RenderedCurvature curvature(problem, target, theta, poll);
  const std::vector<std::vector<double>> samples = curvature.samples(kTraceSamples);
  const QuadraticPenalty& penalty = problem.penalty();
  for (std::size_t i = 0; i < specs.size(); ++i) {
    PenaltyScale scale = problem.penalty_scale(target);
    if (specs[i].bending > 0) scale.slopes = 0;
    const Parameters::Block& block = problem.parameters().blocks()[i];
    const auto [value, rank] = penalty.share(block, theta, scale);
    if (!specs[i].evidence || rank < 1) continue;
    double trace = 0;
    for (const std::vector<double>& sample : samples) trace += penalty.curved(block, sample, scale) / kTraceSamples;
    // What the samples' noise may hide counts as determined, so that the weight stays finite.
    const double determined = std::max(rank - trace, std::sqrt(2 * rank / kTraceSamples));
    // One free unknown has an expected penalty of half a nat. Less is taken for that, so that the weight stays finite.
    factors[i] = determined * scale.priors / std::max(2 * value, scale.priors);
  }
  return factors;
}

double determined_unknowns(const Problem& problem, const GatedImage& target, const std::vector<char>& free,
                           const std::vector<std::vector<double>>& samples) {
  const PenaltyScale scale = problem.penalty_scale(target);
  const QuadraticPenalty prior = problem.prior();
  double determined = 0;
  for (const Parameters::Block& block : problem.parameters().blocks()) {
    const auto begin = free.begin() + block.begin;
    const auto count = static_cast<double>(std::count(begin, begin + block.count, 1));
    double trace = 0;
    for (const std::vector<double>& sample : samples)
      trace += prior.curved(block, sample, scale) / static_cast<double>(samples.size());
    determined += std::max(0.0, count - trace);  // a trace that samples know is rarely above
  }
  return determined;
}

}  // namespace isochron
