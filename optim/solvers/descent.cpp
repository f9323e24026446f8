#include "optim/solvers/descent.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr int kLeastBlock = 5, kMostBlock = 50, kMostRecent = 100, kSpreadRows = 20, kLeastSpreadRows = 5;
constexpr double kVisible = 2, kFalls = 3;  // standard errors

double mean_of_squares(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v * v;
  return sum / static_cast<double>(values.size());
}

/// By how much the mean of losses lies below that of earlier ones, and its standard error.
struct Fall {
  double value, error;
};
Fall fall(const std::vector<double>& before, const std::vector<double>& noise_before, const std::vector<double>& after,
          const std::vector<double>& noise_after) {
  return {mean(before) - mean(after), std::sqrt(mean_of_squares(noise_before) / static_cast<double>(before.size()) +
                                                mean_of_squares(noise_after) / static_cast<double>(after.size()))};
}

std::vector<double> tail(const std::vector<double>& values, int count) {
  return {values.end() - std::min<std::ptrdiff_t>(count, std::ssize(values)), values.end()};
}

void keep_last(std::vector<double>& values, double next) {
  values.push_back(next);
  if (values.size() > kMostRecent) values.erase(values.begin());
}

}  // namespace

Descent::Descent(int iterations, DescentState state)
    : iterations_(iterations),
      block_(std::clamp(iterations / 10, kLeastBlock, kMostBlock)),
      averaged_(std::clamp(3 * iterations / 4, 1, kMostRecent)),
      state_(std::move(state)) {}

std::string Descent::observe(int iteration, const std::vector<double>& theta, double loss, double noise) {
  if (iteration > iterations_ - averaged_) {
    // Rows of a shorter schedule, which the run has gone on from since.
    if (state_.summed >= iteration - (iterations_ - averaged_)) restart_average();
    state_.theta_sum.resize(theta.size(), 0.0);
    for (std::size_t i = 0; i < theta.size(); ++i) state_.theta_sum[i] += theta[i];
    ++state_.summed;
  }
  if (!std::isfinite(loss) || !std::isfinite(noise)) return {};
  keep_last(state_.recent, loss);
  keep_last(state_.recent_noise, noise);
  if (state_.judged) return {};
  if (static_cast<int>(state_.first.size()) < block_) {
    state_.first.push_back(loss);
    state_.first_noise.push_back(noise);
    return {};
  }
  if ((iteration + 1) % block_ != 0 || iteration + 1 < 2 * block_) return {};
  const auto [fallen, error] =
      fall(state_.first, state_.first_noise, tail(state_.recent, block_), tail(state_.recent_noise, block_));
  state_.judged = fallen >= kVisible * error;
  if (state_.judged || fallen <= -kVisible * error || 5 * (iteration + 1) < iterations_) return {};
  state_.judged = true;
  return fmt::format(
      "noise hides whether the loss descends: between the first {0} iterations and the last {0} it fell by {1:.2g}, "
      "which has a standard error of {2:.2g} (samples.primal makes it smaller)",
      block_, fallen, error);
}

void Descent::restart_average() {
  state_.theta_sum.clear();
  state_.summed = 0;
}

bool Descent::settled() const {
  if (state_.summed < averaged_ || averaged_ < 2 || std::ssize(state_.recent) < averaged_) return false;
  const auto halves = [&](const std::vector<double>& values) {
    const std::vector<double> rows = tail(values, averaged_);
    const auto middle = rows.begin() + averaged_ / 2;
    return std::array{std::vector<double>(rows.begin(), middle), std::vector<double>(middle, rows.end())};
  };
  const auto losses = halves(state_.recent), noises = halves(state_.recent_noise);
  const auto [fallen, error] = fall(losses[0], noises[0], losses[1], noises[1]);
  return fallen < kFalls * error;
}

std::vector<double> Descent::settled_theta() const {
  std::vector<double> theta = state_.theta_sum;
  for (double& value : theta) value /= state_.summed;
  return theta;
}

LossSpread loss_spread(const DescentState& state) {
  LossSpread spread;
  const std::vector<double> losses = tail(state.recent, kSpreadRows), noises = tail(state.recent_noise, kSpreadRows);
  spread.rows = static_cast<int>(losses.size());
  spread.deviation = spread.noise_share = std::numeric_limits<double>::quiet_NaN();
  if (losses.empty()) return spread;
  spread.noise = std::sqrt(mean_of_squares(noises));
  if (spread.rows < kLeastSpreadRows) return spread;
  const double centre = mean(losses);
  double squares = 0;
  for (double loss : losses) squares += (loss - centre) * (loss - centre);
  spread.deviation = std::sqrt(squares / (spread.rows - 1));
  if (spread.deviation > 0) spread.noise_share = std::min(1.0, std::pow(spread.noise / spread.deviation, 2));
  return spread;
}

}  // namespace isochron
