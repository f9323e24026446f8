#include "optim/problem/evidence.h"

#include <algorithm>
#include <cmath>

#include "optim/problem/penalties.h"
#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

/// tr((H + P)^-1 H) of the block, by each sample.
std::vector<double> determined_of(const Parameters::Block& block, const PosteriorSamples& samples) {
  std::vector<double> determined;
  for (int k = 0; k < samples.count(); ++k) {
    double sum = 0;
    for (int i = block.begin; i < block.begin + block.count; ++i) sum += samples.pulls[k][i] * samples.unknowns[k][i];
    determined.push_back(sum);
  }
  return determined;
}

double standard_error_of_mean(const std::vector<double>& values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - middle) * (value - middle);
  const auto n = static_cast<double>(values.size());
  return std::sqrt(sum / (n * (n - 1)));
}

/// What the weight of one parameter that evidence is about adds to the loss, in nats.
double penalty_by_evidence(const Problem& problem, std::size_t parameter, const std::vector<double>& theta,
                           PenaltyScale scale) {
  std::vector<ParameterSpec> specs = problem.experiment().parameters;
  const auto weight = weight_by_evidence(specs[parameter]);
  for (std::size_t i = 0; i < specs.size(); ++i)
    for (const auto other : {&ParameterSpec::slopes, &ParameterSpec::bending, &ParameterSpec::variation,
                             &ParameterSpec::tangential, &ParameterSpec::prior_width})
      if (i != parameter || other != weight) specs[i].*other = 0;
  return penalty_of(specs, problem.parameters(), problem.scene()).value(theta, scale) / scale.priors;
}

}  // namespace

double ParameterSpec::*weight_by_evidence(const ParameterSpec& spec) {
  if (spec.variation > 0) return &ParameterSpec::variation;
  return spec.bending > 0 ? &ParameterSpec::bending : &ParameterSpec::slopes;
}

std::vector<double> evidence_factors(const Problem& problem, const GatedImage& target, const std::vector<double>& theta,
                                     const PosteriorSamples& samples) {
  const std::vector<ParameterSpec>& specs = problem.experiment().parameters;
  std::vector<double> factors(specs.size(), 1.0);
  const PenaltyScale scale = problem.penalty_scale(target);
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (!specs[i].evidence || !(specs[i].*weight_by_evidence(specs[i]) > 0)) continue;
    const std::vector<double> by_sample = determined_of(problem.parameters().blocks()[i], samples);
    // What the samples' noise may hide counts as determined, so that the weight stays finite; so it is with 1, which comes first as
    // std::max keeps it where another is no number.
    const double determined = std::max({1.0, mean(by_sample), standard_error_of_mean(by_sample)});
    // One free unknown has an expected penalty of half a nat. Less is taken for that, so that the weight stays finite.
    factors[i] = determined / std::max(1.0, 2 * penalty_by_evidence(problem, i, theta, scale));
  }
  return factors;
}

std::vector<double> evidence_factors(const Problem& problem, const GatedImage& target,
                                     const std::vector<double>& theta) {
  return evidence_factors(problem, target, theta, RenderedCurvature(problem, target, theta).samples());
}

double determined_unknowns(const Problem& problem, const std::vector<char>& free, const PosteriorSamples& samples) {
  const QuadraticPenalty prior = problem.prior();
  double determined = 0;
  for (const Parameters::Block& block : problem.parameters().blocks()) {
    const auto begin = free.begin() + block.begin;
    const auto count = static_cast<double>(std::count(begin, begin + block.count, 1));
    determined += prior.holds(block) ? std::clamp(mean(determined_of(block, samples)), 0.0, count) : count;
  }
  return determined;
}

}  // namespace isochron
