#include "optim/analysis/gradient_error.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/vector_math.h"

namespace isochron {
namespace {

constexpr std::size_t kUpperLevels = 3;

/// Of a group, for the noise's own size: enough for some percent, and quick for many unknowns; fewer tell
/// nothing.
constexpr std::size_t kMostDifferences = 32, kFewestDifferences = 6;

double square(double x) {
  return x * x;
}

double squared_distance(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += square(a[i] - b[i]);
  return sum;
}

/// Least squares, all points alike.
double slope_of(const std::vector<double>& x, const std::vector<double>& y) {
  const double n = static_cast<double>(x.size());
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) mean_x += x[i] / n, mean_y += y[i] / n;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += square(x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  return xy / xx;
}

}  // namespace

std::vector<double> mean(const Repeats& repeats) {
  std::vector<double> sum(repeats.front().size(), 0.0);
  for (const auto& repeat : repeats)
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += repeat[i];
  for (double& s : sum) s /= static_cast<double>(repeats.size());
  return sum;
}

Measured total_variance(const Repeats& repeats) {
  const std::vector<double> center = mean(repeats);
  const double n = static_cast<double>(repeats.size());
  double sum = 0, squares = 0;
  for (const auto& repeat : repeats) {
    const double d = squared_distance(repeat, center) * n / (n - 1);
    sum += d;
    squares += d * d;
  }
  const double variance = sum / n;
  return {variance, n > 2 ? std::sqrt(std::max(0.0, squares / n - square(variance)) / (n - 1)) : 0.0};
}

SquaredNorm squared_norm(std::span<const WeightedRepeats> groups) {
  std::vector<double> total(groups[0].repeats->front().size(), 0.0);
  double noise = 0;  // trace of C
  // Differences of repeats, scaled so that the average of their squares is their group's part of C.
  std::vector<Repeats> differences;
  std::vector<double> noises;
  for (const auto& [repeats, weight] : groups) {
    const double n = static_cast<double>(repeats->size());
    const std::vector<double> center = mean(*repeats);
    for (std::size_t i = 0; i < total.size(); ++i) total[i] += weight * center[i];
    noises.push_back(square(weight) * total_variance(*repeats).value / n);
    noise += noises.back();
    Repeats& of_group = differences.emplace_back();
    const double scale = weight / std::sqrt(2 * n);
    for (std::size_t k = 0; k + 1 < repeats->size() && of_group.size() < kMostDifferences; k += 2) {
      std::vector<double> difference = (*repeats)[k];
      for (std::size_t i = 0; i < difference.size(); ++i)
        difference[i] = scale * (difference[i] - (*repeats)[k + 1][i]);
      of_group.push_back(std::move(difference));
    }
  }
  double along = 0, square_trace = 0;  // d'Cd, tr(C^2)
  for (std::size_t g = 0; g < differences.size(); ++g) {
    for (const auto& u : differences[g]) along += square(dot(total, u)) / static_cast<double>(differences[g].size());
    for (std::size_t h = 0; h < differences.size(); ++h) {
      if (g == h && differences[g].size() < kFewestDifferences) {
        square_trace += square(noises[g]);  // the most that it can be
        continue;
      }
      double sum = 0;
      for (std::size_t k = 0; k < differences[g].size(); ++k)
        for (std::size_t l = 0; l < differences[h].size(); ++l)
          if (g != h || k != l) sum += square(dot(differences[g][k], differences[h][l]));
      const std::size_t pairs = differences[g].size() * (differences[h].size() - (g == h ? 1 : 0));
      square_trace += sum / static_cast<double>(pairs);
    }
  }
  SquaredNorm result;
  result.value = dot(total, total) - noise;
  result.error_if_zero = std::sqrt(2 * square_trace);
  result.standard_error = std::sqrt(2 * square_trace + 4 * std::max(0.0, along - square_trace));
  return result;
}

MethodError method_error(const std::vector<SampleLevel>& levels, const Repeats& reference, double norm2, double scale,
                         bool bias_from_all) {
  MethodError result;
  std::vector<double> log_time, log_deviation;
  const std::size_t upper = std::min(kUpperLevels, levels.size());
  for (std::size_t r = 0; r < levels.size(); ++r) {
    const Measured variance = total_variance(levels[r].repeats);
    const double time = levels[r].core_seconds;
    if (r + upper >= levels.size()) {
      const double share = scale / norm2 * time / static_cast<double>(upper);
      result.rate.value += share * variance.value;
      result.rate.standard_error = std::hypot(result.rate.standard_error, share * variance.standard_error);
    }
    if (!(variance.value > 0)) continue;
    log_time.push_back(std::log(time));
    log_deviation.push_back(0.5 * std::log(variance.value));
  }
  result.slope = log_time.size() > 1 ? slope_of(log_time, log_deviation) : std::numeric_limits<double>::quiet_NaN();

  // All samples alike: a level counts by its repeats times their samples.
  double samples = 0;
  const std::size_t first = bias_from_all ? 0 : levels.size() - 1;
  for (std::size_t r = first; r < levels.size(); ++r)
    samples += levels[r].factor * static_cast<double>(levels[r].repeats.size());
  std::vector<WeightedRepeats> groups{{&reference, -1}};
  for (std::size_t r = first; r < levels.size(); ++r)
    groups.push_back({&levels[r].repeats, levels[r].factor * static_cast<double>(levels[r].repeats.size()) / samples});
  result.bias2 = squared_norm(groups);
  for (double* x : {&result.bias2.value, &result.bias2.standard_error, &result.bias2.error_if_zero})
    *x *= scale / norm2;
  return result;
}

bool significant(const SquaredNorm& bias2) {
  return bias2.value > 3 * bias2.error_if_zero;
}

Measured core_seconds_to(double error, const MethodError& method) {
  const double left = error * error - (significant(method.bias2) ? method.bias2.value : 0);
  if (!(left > 0)) return {std::numeric_limits<double>::infinity(), 0};
  return {method.rate.value / left, method.rate.standard_error / left};
}

}  // namespace isochron
