#include "optim/solvers/safeguard.h"

#include <algorithm>
#include <cmath>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr std::size_t kRecent = 21, kFewestForRise = 8, kLevel = 5, kRisen = 3;
constexpr double kRise = 6;  // times the noise
constexpr int kMostRejectedInRow = 5;
/// Median of |difference| of two normal numbers of standard deviation 1: 0.6745 sqrt(2).
constexpr double kMedianDifference = 0.9539;

/// Square of the standard error of the mean.
double squared_error(const std::vector<double>& values) {
  const double centre = mean(values), n = static_cast<double>(values.size());
  double sum = 0;
  for (double v : values) sum += (v - centre) * (v - centre);
  return sum / (n * (n - 1));
}

}  // namespace

Verdict Safeguard::observe(double loss, bool finite, const std::vector<double>& theta) {
  if (state_.best_theta.empty()) state_.best_theta = theta;
  if (!finite) return reject();
  std::vector<double>& recent = state_.recent;
  recent.push_back(loss);
  if (recent.size() > kRecent) recent.erase(recent.begin());
  const double level =
      median({recent.end() - static_cast<std::ptrdiff_t>(std::min(kLevel, recent.size())), recent.end()});
  if (level < state_.best_level) {
    state_.best_level = level;
    state_.best_theta = theta;
    state_.rejected_in_row = 0;
  }
  if (rises()) return reject();
  return settles(theta) ? Verdict::settled : Verdict::go_on;
}

bool Safeguard::rises() const {
  const std::vector<double>& recent = state_.recent;
  if (recent.size() < kFewestForRise) return false;
  std::vector<double> differences;
  for (std::size_t i = 1; i < recent.size(); ++i) differences.push_back(std::abs(recent[i] - recent[i - 1]));
  const double limit = state_.best_level + kRise * median(differences) / kMedianDifference;
  return std::all_of(recent.end() - kRisen, recent.end(), [&](double loss) { return loss > limit; });
}

bool Safeguard::settles(const std::vector<double>& theta) {
  if (window_ == 0) return false;
  if (static_cast<int>(state_.block.size()) == window_) {
    state_.block_before = std::move(state_.block);
    state_.block.clear();
    state_.theta_sum.clear();
  }
  state_.theta_sum.resize(theta.size(), 0.0);
  for (std::size_t i = 0; i < theta.size(); ++i) state_.theta_sum[i] += theta[i];
  // The rows carry independent noise, those of one block differ by their trend too: that only makes the error
  // larger.
  state_.block.push_back(state_.recent.back());
  if (static_cast<int>(state_.block.size()) < window_ || state_.block_before.empty()) return false;
  const double decrease = mean(state_.block_before) - mean(state_.block);
  return decrease < std::sqrt(squared_error(state_.block_before) + squared_error(state_.block)) || decrease <= 0;
}

void Safeguard::restart_window() {
  state_.block.clear();
  state_.block_before.clear();
  state_.theta_sum.clear();
}

Verdict Safeguard::reject() {
  ++state_.rejected;
  state_.rate /= 2;
  state_.recent.clear();
  restart_window();
  return ++state_.rejected_in_row >= kMostRejectedInRow ? Verdict::give_up : Verdict::reject;
}

std::vector<double> Safeguard::settled_theta() const {
  std::vector<double> theta = state_.theta_sum;
  for (double& value : theta) value /= static_cast<double>(state_.block.size());
  return theta;
}

}  // namespace isochron
