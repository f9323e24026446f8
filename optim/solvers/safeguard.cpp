#include "optim/solvers/safeguard.h"

#include <algorithm>
#include <cmath>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr std::size_t kRecent = 21, kFewestForRise = 8, kLevel = 5, kRisen = 3;
/// Times the noise as differences show it, the error that losses of the lowest level state, and that of the last losses.
constexpr double kRise = 6, kRiseOfLevel = 3, kRiseOfStated = 4;
constexpr int kMostRejectedInRow = 5;
/// Of fewer rows the variance is known too badly: squared means in its units have no variance of their own below 6.
constexpr int kRowsOfGradient = 20;
constexpr double kGradientDeviations = 3;
/// Median of |difference| of two normal numbers of standard deviation 1: 0.6745 sqrt(2).
constexpr double kMedianDifference = 0.9539;

/// Square of the standard error of the mean.
double squared_error(const std::vector<double>& values) {
  const double centre = mean(values), n = static_cast<double>(values.size());
  double sum = 0;
  for (double v : values) sum += (v - centre) * (v - centre);
  return sum / (n * (n - 1));
}

template <class Function>
void add(std::vector<double>& sum, const std::vector<double>& values, Function of) {
  sum.resize(values.size(), 0.0);
  for (std::size_t i = 0; i < values.size(); ++i) sum[i] += of(values[i]);
}

}  // namespace

Verdict Safeguard::observe(double loss, double noise, bool finite, const std::vector<double>& theta,
                           const std::vector<double>& gradient) {
  if (state_.best_theta.empty()) state_.best_theta = theta;
  if (!finite) return reject();
  std::vector<double>& recent = state_.recent;
  recent.push_back(loss);
  if (recent.size() > kRecent) recent.erase(recent.begin());
  state_.recent_noise.push_back(std::isfinite(noise) ? noise : 0);
  if (state_.recent_noise.size() > kLevel) state_.recent_noise.erase(state_.recent_noise.begin());
  const double level =
      median({recent.end() - static_cast<std::ptrdiff_t>(std::min(kLevel, recent.size())), recent.end()});
  if (level < state_.best_level) {
    state_.best_level = level;
    state_.best_noise = median(state_.recent_noise);
    state_.best_theta = theta;
    state_.rejected_in_row = 0;
  }
  if (rises()) return reject();
  return settles(theta, gradient) ? Verdict::settled : Verdict::go_on;
}

bool Safeguard::rises() const {
  const std::vector<double>& recent = state_.recent;
  if (recent.size() < kFewestForRise) return false;
  std::vector<double> differences;
  for (std::size_t i = 1; i < recent.size(); ++i) differences.push_back(std::abs(recent[i] - recent[i - 1]));
  const double limit =
      state_.best_level + std::max({kRise * median(differences) / kMedianDifference, kRiseOfLevel * state_.best_noise,
                                    kRiseOfStated * median(state_.recent_noise)});
  return std::all_of(recent.end() - kRisen, recent.end(), [&](double loss) { return loss > limit; });
}

bool Safeguard::settles(const std::vector<double>& theta, const std::vector<double>& gradient) {
  if (window_ == 0) return false;
  if (static_cast<int>(state_.block.size()) == window_) {
    state_.block_before = std::move(state_.block);
    clear_sums();
  }
  add(state_.theta_sum, theta, [](double v) { return v; });
  if (window_ >= kRowsOfGradient) {
    add(state_.gradient_sum, gradient, [](double v) { return v; });
    add(state_.gradient_squares, gradient, [](double v) { return v * v; });
  }
  // The rows carry independent noise, those of one block differ by their trend too: that only makes the error
  // larger.
  state_.block.push_back(state_.recent.back());
  if (static_cast<int>(state_.block.size()) < window_ || state_.block_before.empty()) return false;
  const double decrease = mean(state_.block_before) - mean(state_.block);
  const double error = std::sqrt(squared_error(state_.block_before) + squared_error(state_.block));
  return (decrease < error || decrease <= 0) && gradient_is_noise();
}

bool Safeguard::gradient_is_noise() const {
  const double n = window_;
  double sum = 0, unknowns = 0;
  for (std::size_t i = 0; i < state_.gradient_sum.size(); ++i) {
    const double centre = state_.gradient_sum[i] / n;
    if (centre == 0) continue;  // of no influence, or held by a bound
    // What is the same in every row has no noise.
    const double variance = std::max(0.0, state_.gradient_squares[i] / n - centre * centre) / (n - 1);
    sum += centre * centre / variance;
    ++unknowns;
  }
  // Each term has an F distribution with 1 and n - 1 degrees of freedom.
  const double expected = (n - 1) / (n - 3), variance = 2 * expected * expected * (n - 2) / (n - 5);
  return unknowns == 0 || sum <= unknowns * expected + kGradientDeviations * std::sqrt(unknowns * variance);
}

void Safeguard::clear_sums() {
  for (std::vector<double>* sum : {&state_.block, &state_.theta_sum, &state_.gradient_sum, &state_.gradient_squares})
    sum->clear();
}

void Safeguard::restart_window() {
  clear_sums();
  state_.block_before.clear();
}

Verdict Safeguard::reject() {
  ++state_.rejected;
  state_.rate /= 2;
  state_.recent.clear();
  state_.recent_noise.clear();
  restart_window();
  return ++state_.rejected_in_row >= kMostRejectedInRow ? Verdict::give_up : Verdict::reject;
}

std::vector<double> Safeguard::settled_theta() const {
  std::vector<double> theta = state_.theta_sum;
  for (double& value : theta) value /= static_cast<double>(state_.block.size());
  return theta;
}

}  // namespace isochron
