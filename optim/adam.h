// Adam (Kingma and Ba 2015, algorithm 1) with bounds: a step that would leave [lower, upper] ends on the
// bound.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace isochron {

struct AdamOptions {
  double learning_rate = 0.02;  ///< > 0, units of the unknowns
  double beta1 = 0.9, beta2 = 0.999;
};

/// All that a resumed optimiser needs.
struct AdamState {
  long long steps = 0;
  std::vector<double> m, v;  ///< running means of the gradient and its square
};

/// One step on `theta`; every vector has its size, `state.m` and `state.v` may be empty before the first
/// step. The algorithm's epsilon (1e-8 in the paper, absolute) is left out: it would make the step depend on
/// the unit of the loss. Where every gradient so far was zero the unknown stays.
inline void adam_step(const AdamOptions& options, const std::vector<double>& gradient,
                      const std::vector<double>& lower, const std::vector<double>& upper, AdamState& state,
                      std::vector<double>& theta) {
  state.m.resize(theta.size(), 0.0);
  state.v.resize(theta.size(), 0.0);
  ++state.steps;
  const double correction1 = 1 - std::pow(options.beta1, static_cast<double>(state.steps));
  const double correction2 = 1 - std::pow(options.beta2, static_cast<double>(state.steps));
  for (std::size_t i = 0; i < theta.size(); ++i) {
    state.m[i] = options.beta1 * state.m[i] + (1 - options.beta1) * gradient[i];
    state.v[i] = options.beta2 * state.v[i] + (1 - options.beta2) * gradient[i] * gradient[i];
    const double deviation = std::sqrt(state.v[i] / correction2);
    if (deviation > 0)
      theta[i] = std::clamp(theta[i] - options.learning_rate * (state.m[i] / correction1) / deviation,
                            lower[i], upper[i]);
  }
}

}  // namespace isochron
