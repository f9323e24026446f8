#include "optim/solvers/sample_share.h"

#include <algorithm>
#include <cmath>

namespace isochron {
namespace {

constexpr double kDecay = 0.9;
/// Gradients that are judged together at least: that noise of one unknown passes for a signal of twice its size has probability 1e-5.
constexpr int kJudged = 10;
constexpr double kNoise = 0.25;  ///< variance, over the square of the signal

}  // namespace

void SampleShare::observe(const std::vector<double>& gradient) {
  mean_.resize(gradient.size(), 0.0);
  double square = 0;
  for (std::size_t i = 0; i < gradient.size(); ++i) {
    mean_[i] = kDecay * mean_[i] + (1 - kDecay) * gradient[i];
    square += gradient[i] * gradient[i];
  }
  square_ = kDecay * square_ + (1 - kDecay) * square;
  if (++seen_ < kJudged || !(square_ > 0)) return;
  double of_mean = 0;
  for (const double m : mean_) of_mean += m * m;
  const double past = std::pow(kDecay, seen_), agreement = of_mean / (square_ * (1 - past));
  const double of_noise = (1 - kDecay) / (1 + kDecay) * (1 + past) / (1 - past);
  const double signal = std::max(0.0, (agreement - of_noise) / (1 - of_noise)), noise = 1 - signal;
  int parts = 1;
  while (2 * parts <= most_ && 2 * parts * noise <= parts_ * kNoise * signal) parts *= 2;
  if (parts == parts_) return;
  parts_ = parts;
  seen_ = 0;
  square_ = 0;
  std::fill(mean_.begin(), mean_.end(), 0.0);
}

std::vector<double> SampleShare::state() const {
  std::vector<double> state{static_cast<double>(parts_), static_cast<double>(seen_), square_};
  state.insert(state.end(), mean_.begin(), mean_.end());
  return state;
}

void SampleShare::restore(const std::vector<double>& state) {
  parts_ = static_cast<int>(state.at(0));
  seen_ = static_cast<int>(state.at(1));
  square_ = state.at(2);
  mean_.assign(state.begin() + 3, state.end());
}

}  // namespace isochron
