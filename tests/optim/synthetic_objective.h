#pragma once
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <vector>

#include "core/base/random.h"
#include "optim/problem/objective.h"

namespace isochron {

/// What `probe` makes of each number.
template <class F>
std::vector<std::vector<double>> of_each(Probes probes, F&& probe) {
  std::vector<std::vector<double>> found;
  for (int k = 0; k < probes.count; ++k) found.push_back(probe(probes.first + k));
  return found;
}

/// Fit of a exp(-b x) to its values at a = 2, b = 0.7 on 60 points x, as noisy as asked: theta = (a, b). The
/// same noise for the same iteration; independent noise for residuals and each half of the Jacobian.
class ExponentialFit : public Objective {
 public:
  double residual_noise = 0, jacobian_noise = 0;  ///< standard deviations of single entries
  double loss_noise = 0;                          ///< stated, not made
  std::vector<double> low{-10, -10}, high{10, 10};
  /// Called with theta and the loss of every evaluation; what it returns is the loss.
  std::function<double(const std::vector<double>&, double)> inject = [](auto&, double loss) { return loss; };
  mutable int losses = 0, gradients = 0;

  const std::vector<double>& lower() const override { return low; }
  const std::vector<double>& upper() const override { return high; }

  double loss(const std::vector<double>& theta, std::uint32_t iteration) const override {
    ++losses;
    double sum = 0;
    for (int k = 0; k < kPoints; ++k) sum += std::pow(residual(theta, k, iteration), 2);
    return inject(theta, sum / kPoints);
  }

  Evaluation evaluate(const std::vector<double>& theta, std::uint32_t iteration) const override {
    return linearise(theta, iteration);
  }

  Evaluation linearise(const std::vector<double>& theta, std::uint32_t iteration) const override {
    ++gradients;
    Evaluation result;
    result.loss = loss(theta, iteration);
    result.mean_squared_error = result.loss;
    result.loss_noise = loss_noise;
    result.gradient.assign(2, 0.0);
    result.curvature.assign(4, 0.0);
    result.curvature_bound.assign(4, 0.0);
    for (int k = 0; k < kPoints; ++k) {
      const double r = residual(theta, k, iteration), x = point(k);
      double half[2][2];
      for (int h : {0, 1}) {
        Rng rng({5, iteration, 1}, k, h);
        half[h][0] = std::exp(-theta[1] * x) + jacobian_noise * normal(rng);
        half[h][1] = -theta[0] * x * std::exp(-theta[1] * x) + jacobian_noise * normal(rng);
      }
      for (int i : {0, 1}) {
        result.gradient[i] += (half[0][i] + half[1][i]) * r / kPoints;
        for (int j : {0, 1}) {
          result.curvature[2 * i + j] += (half[0][i] * half[1][j] + half[1][i] * half[0][j]) / kPoints;
          result.curvature_bound[2 * i + j] += (half[0][i] + half[1][i]) * (half[0][j] + half[1][j]) / (2 * kPoints);
        }
      }
    }
    return result;
  }

  std::vector<std::vector<double>> probe_curvature(const std::vector<double>& theta, std::uint32_t iteration,
                                                   const Evaluation&, Probes probes) const override {
    return of_each(probes, [&](int probe) -> std::vector<double> {
      double sum[2] = {0, 0};
      for (int k = 0; k < kPoints; ++k) {
        Rng rng({5, iteration, 2}, k, probe);
        const double sign = rng.uniform() < 0.5 ? -1 : 1, x = point(k);
        sum[0] += sign * std::exp(-theta[1] * x) * std::sqrt(2.0 / kPoints);
        sum[1] -= sign * theta[0] * x * std::exp(-theta[1] * x) * std::sqrt(2.0 / kPoints);
      }
      return {sum[0] * sum[0], sum[1] * sum[1]};
    });
  }

  static double normal(Rng& rng) {
    const double radius = std::sqrt(-2 * std::log(rng.uniform()));
    return radius * std::cos(2 * std::numbers::pi * rng.uniform());
  }

 private:
  static constexpr int kPoints = 60;
  static double point(int k) { return 0.05 * k; }
  double residual(const std::vector<double>& theta, int k, std::uint32_t iteration) const {
    const double x = point(k);
    double r = theta[0] * std::exp(-theta[1] * x) - 2 * std::exp(-0.7 * x);
    if (residual_noise > 0) {
      Rng rng({5, iteration, 0}, k, 0);
      r += residual_noise * normal(rng);
    }
    return r;
  }
};

}  // namespace isochron
