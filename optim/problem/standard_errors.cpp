#include "optim/problem/standard_errors.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
/// What is determined that much better together is stated so, though each alone has an error, too.
constexpr double kBetterTogether = 10;

/// A combination and how it depends on the unknowns, component by component and on average.
struct Functions {
  const Parameters::Block& other;
  int pivot;
  Combination combination;
  /// Derivatives of each component by the pivot and by the other parameter's component.
  std::vector<double> by_pivot, by_other;
  std::vector<double> mean;

  /// Weights of all unknowns. Made when needed: those of all components of a field would be a matrix of gigabytes.
  std::vector<double> component(int i) const {
    std::vector<double> weights(mean.size(), 0.0);
    weights[pivot] = by_pivot[i];
    weights[other.begin + i] = by_other[i];
    return weights;
  }
};

Functions functions_of(const NullDirection& direction, const NullDirection::Partner& partner,
                       const std::vector<Parameters::Block>& blocks, const std::vector<double>& theta) {
  const Parameters::Block& other = blocks[partner.block];
  const auto is_pivot = [&](const Parameters::Block& b) { return b.begin == direction.pivot; };
  const std::string& name = std::find_if(blocks.begin(), blocks.end(), is_pivot)->name;
  const double pivot = theta[direction.pivot], p = partner.power;
  Functions result{other, direction.pivot, {combination_name(name, other.name, partner), {}, {}, 0, 0}, {}, {}, {}};
  result.mean.resize(theta.size());
  for (int i = other.begin; i < other.begin + other.count; ++i) {
    const double x = theta[i], factor = partner.product ? std::pow(x, p) : 1;
    result.by_pivot.push_back(factor);
    result.by_other.push_back(partner.product ? pivot * p * std::pow(x, p - 1) : p);
    result.mean[direction.pivot] += factor / other.count;
    result.mean[i] += result.by_other.back() / other.count;
    result.combination.values.push_back(partner.product ? pivot * factor : pivot + p * x);
    result.combination.mean += result.combination.values.back() / other.count;
  }
  return result;
}

/// Parameters all of whose unknowns are undetermined, and single components.
std::vector<std::string> undetermined_names(const std::vector<Parameters::Block>& blocks,
                                            const std::vector<std::string>& names,
                                            const std::vector<bool>& undetermined) {
  std::vector<std::string> found;
  for (const Parameters::Block& block : blocks) {
    const auto begin = undetermined.begin() + block.begin;
    if (std::count(begin, begin + block.count, true) == block.count) {
      found.push_back(block.name);
      continue;
    }
    for (int i = block.begin; i < block.begin + block.count; ++i)
      if (undetermined[i]) found.push_back(names[i]);
  }
  return found;
}

}  // namespace

double variance_scale(const Problem& problem, const Evaluation& at) {
  const double readings = problem.readings().count(at.image);
  if (problem.experiment().loss.kind == LossKind::poisson) return 1 / readings;
  return at.mean_squared_error > 0 ? 2 * at.mean_squared_error / readings : std::numeric_limits<double>::quiet_NaN();
}

StepMoments moments(const std::vector<double>& steps) {
  const double count = static_cast<double>(steps.size()), middle = steps.empty() ? 0 : mean(steps);
  double squares = 0;
  for (const double step : steps) squares += (step - middle) * (step - middle);
  return {middle, count > 1 ? squares / (count - 1) : 0};
}

Determined::Determined(const std::vector<Parameters::Block>& blocks, const std::vector<std::string>& names,
                       const std::vector<double>& theta, const std::vector<double>& matrix,
                       const std::vector<ParameterChange>& changes, std::vector<bool> unseen,
                       const std::vector<bool>& free)
    : blocks_(blocks), names_(names), theta_(theta), undetermined_(std::move(unseen)), fixed_(theta.size()) {
  for (std::size_t i = 0; i < theta.size(); ++i) fixed_[i] = undetermined_[i] && !free[i];
  directions_ = null_directions(matrix, changes, blocks, theta);
  exact_ = directions_.size();
  for (const NullDirection& direction : directions_) {
    fixed_[direction.pivot] = true;
    for (std::size_t i = 0; i < theta.size(); ++i)
      if (direction.change[i] != 0) undetermined_[i] = true;
  }
  const double near_null = 1 / (kBetterTogether * kBetterTogether);
  for (const ChangeKinds kinds : {ChangeKinds::summands, ChangeKinds::factors})
    for (NullDirection& near : null_directions(matrix, changes, blocks, theta, near_null, kinds)) {
      const auto same = [&](const NullDirection& other) { return other.pivot == near.pivot; };
      if (near.partners.size() == 1 && !undetermined_[near.pivot] && std::ranges::none_of(directions_, same))
        directions_.push_back(std::move(near));
    }
}

ParameterErrors Determined::errors(const NoiseLevel& noise, const std::vector<bool>& asked,
                                   const std::vector<double>& least, const Spreads& spreads) const {
  std::vector<std::vector<double>> weights;
  for (std::size_t i = 0; i < theta_.size(); ++i) {
    if (!asked[i] || fixed_[i]) continue;
    weights.emplace_back(theta_.size(), 0.0);
    weights.back()[i] = 1;
  }
  std::vector<Functions> functions;
  std::vector<int> near_pivots;  // -1: of an exact direction
  for (std::size_t d = 0; d < directions_.size(); ++d)
    for (const NullDirection::Partner& partner : directions_[d].partners) {
      functions.push_back(functions_of(directions_[d], partner, blocks_, theta_));
      near_pivots.push_back(d < exact_ ? -1 : directions_[d].pivot);
      const Functions& last = functions.back();
      for (int i = 0; asked[last.other.begin] && i < last.other.count; ++i) weights.push_back(last.component(i));
      weights.push_back(last.mean);
    }

  const std::vector<Spread> found = spreads(weights);
  auto next = found.begin();
  const auto next_error = [&] {
    const Spread& spread = *next++;
    return std::sqrt(noise.scale * spread.variance + (noise.rendered ? moments(spread.steps).variance : 0));
  };
  ParameterErrors result;
  std::vector<bool> undetermined = undetermined_;
  std::vector<double> values = least;
  values.resize(theta_.size(), kInfinite);
  for (const Parameters::Block& block : blocks_)
    for (int i = block.begin; i < block.begin + block.count; ++i) {
      if (asked[i] && !fixed_[i]) {
        const StepMoments step = moments(next->steps);
        const double doubt = 2 * std::sqrt(step.variance / static_cast<double>(next->steps.size()));
        values[i] = next_error();
        if (std::isinf(values[i])) undetermined[i] = true;
        if (block.count <= kFewComponents && !undetermined[i] && std::abs(step.mean) > values[i] + doubt)
          result.steps_left.emplace_back(names_[i], step.mean);
      }
      if (undetermined[i]) values[i] = kInfinite;
    }
  for (std::size_t c = 0; c < functions.size(); ++c) {
    const Functions& of = functions[c];
    Combination combination = of.combination;
    for (int i = 0; i < of.other.count; ++i)
      combination.errors.push_back(asked[of.other.begin] ? next_error()
                                                         : std::abs(of.by_other[i]) * least[of.other.begin + i]);
    combination.mean_error = next_error();
    if (near_pivots[c] < 0 || kBetterTogether * combination.mean_error < values[near_pivots[c]])
      result.combinations.push_back(std::move(combination));
  }
  if (std::isfinite(noise.scale)) result.values = std::move(values);
  result.undetermined = undetermined_names(blocks_, names_, undetermined);
  return result;
}

}  // namespace isochron
