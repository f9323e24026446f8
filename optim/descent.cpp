#include "optim/descent.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/vector_math.h"

namespace isochron {
namespace {

constexpr int kLeastBlock = 5, kMostBlock = 50, kSpreadRows = 20, kLeastSpreadRows = 5;
constexpr double kVisible = 2;  // standard errors

double mean_of_squares(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v * v;
  return sum / static_cast<double>(values.size());
}

std::vector<double> tail(const std::vector<double>& values, int count) {
  return {values.end() - std::min<std::ptrdiff_t>(count, std::ssize(values)), values.end()};
}

void keep_last(std::vector<double>& values, double next) {
  values.push_back(next);
  if (values.size() > kMostBlock) values.erase(values.begin());
}

}  // namespace

Descent::Descent(int iterations, DescentState state)
    : iterations_(iterations), block_(std::clamp(iterations / 10, kLeastBlock, kMostBlock)), state_(std::move(state)) {}

std::string Descent::observe(int iteration, double loss, double noise) {
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
  const double fall = mean(state_.first) - mean(tail(state_.recent, block_));
  const double error =
      std::sqrt((mean_of_squares(state_.first_noise) + mean_of_squares(tail(state_.recent_noise, block_))) / block_);
  state_.judged = fall >= kVisible * error;
  if (state_.judged || fall <= -kVisible * error || 5 * (iteration + 1) < iterations_) return {};
  state_.judged = true;
  return fmt::format(
      "noise hides whether the loss descends: between the first {0} iterations and the last {0} it fell by {1:.2g}, "
      "which has a standard error of {2:.2g} (samples.primal makes it smaller)",
      block_, fall, error);
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
