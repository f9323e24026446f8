// Adam (Kingma and Ba 2015, algorithm 1) with bounds: a step that would leave [lower, upper] ends on the
// bound.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "optim/problem/smoothing.h"

namespace isochron {

struct AdamOptions {
  double learning_rate = 0.02;  ///< > 0, in units of the unknowns that it is given
  double beta1 = 0.9, beta2 = 0.999;
};

/// All that a resumed optimiser needs.
struct AdamState {
  long long steps = 0;
  std::vector<double> m, v;  ///< running means of the gradient and its square
};

/// One step on `theta`, preconditioned by P: Adam acts on the variables w of theta = P w, whose gradient is P
/// times theta's (Nicolet, Jacobson and Jakob 2021, who use P = (I + lambda L)^-1). Within a block that P
/// acts on, all variables share the largest mean square, or else Adam's division would undo the smoothing.
/// Every vector has its size, `state.m` and `state.v` may be empty before the first step. The algorithm's
/// epsilon (1e-8 in the paper, absolute) is left out: it would make the step depend on the unit of the loss.
/// Where every gradient so far was zero the unknown stays.
inline void adam_step(const AdamOptions& options, const std::vector<double>& gradient, const std::vector<double>& lower,
                      const std::vector<double>& upper, AdamState& state, std::vector<double>& theta,
                      const Preconditioner& preconditioner = {}) {
  state.m.resize(theta.size(), 0.0);
  state.v.resize(theta.size(), 0.0);
  ++state.steps;
  const double correction1 = 1 - std::pow(options.beta1, static_cast<double>(state.steps));
  const double correction2 = 1 - std::pow(options.beta2, static_cast<double>(state.steps));
  std::vector<double> slope = gradient;
  preconditioner.apply(slope);
  for (std::size_t i = 0; i < theta.size(); ++i) {
    state.m[i] = options.beta1 * state.m[i] + (1 - options.beta1) * slope[i];
    state.v[i] = options.beta2 * state.v[i] + (1 - options.beta2) * slope[i] * slope[i];
  }
  std::vector<double> mean_square = state.v;
  for (const Parameters::Block& block : preconditioner.blocks()) {
    const auto begin = mean_square.begin() + block.begin, end = begin + block.count;
    std::fill(begin, end, *std::max_element(begin, end));
  }
  std::vector<double> step(theta.size(), 0.0);
  for (std::size_t i = 0; i < theta.size(); ++i)
    if (mean_square[i] > 0)
      step[i] = options.learning_rate * (state.m[i] / correction1) / std::sqrt(mean_square[i] / correction2);
  preconditioner.apply(step);
  for (std::size_t i = 0; i < theta.size(); ++i) theta[i] = std::clamp(theta[i] - step[i], lower[i], upper[i]);
}

}  // namespace isochron
