#include "optim/problem/loss.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace isochron {
namespace {

/// Adds up a mean and its variance over pixels, each of which has values of its own.
class PixelSums {
 public:
  /// `error`: what both halves disagree in, of the value.
  void add(double value, double error) {
    pixel_value_ += value;
    pixel_error_ += error;
  }
  void end_pixel() {
    value_ += pixel_value_;
    squared_values_ += pixel_value_ * pixel_value_;
    squared_errors_ += pixel_error_ * pixel_error_;
    pixel_value_ = pixel_error_ = 0;
  }
  double value() const { return value_; }
  double standard_error(int pixels) const {
    const double scatter = squared_values_ - value_ * value_ / pixels;
    return std::sqrt(std::max(0.0, std::min(squared_errors_, scatter)));
  }

 private:
  double value_ = 0, squared_values_ = 0, squared_errors_ = 0, pixel_value_ = 0, pixel_error_ = 0;
};

}  // namespace

double RobustLoss::value(double r) const {
  if (kind == LossKind::huber && std::abs(r) > scale) return scale * (2 * std::abs(r) - scale);
  if (kind == LossKind::cauchy) return scale * scale * std::log1p((r / scale) * (r / scale));
  return r * r;
}

double RobustLoss::weight(double r) const {
  if (kind == LossKind::huber && std::abs(r) > scale) return scale / std::abs(r);
  if (kind == LossKind::cauchy) return 1 / (1 + (r / scale) * (r / scale));
  return 1;
}

double RobustLoss::second(double r) const {
  if (kind == LossKind::huber && std::abs(r) > scale) return 0;
  if (kind == LossKind::cauchy) {
    const double t = (r / scale) * (r / scale);
    return 2 * (1 - t) / ((1 + t) * (1 + t));
  }
  return 2;
}

double RobustLoss::third(double r) const {
  if (kind != LossKind::cauchy) return 0;
  const double x = r / scale, t = x * x;
  return -4 * x * (3 - t) / ((1 + t) * (1 + t) * (1 + t)) / scale;
}

SplitImage join_halves(const GatedImage& first, int first_samples, const GatedImage& second, int second_samples) {
  SplitImage joined{first, first, static_cast<double>(first_samples) / (first_samples + second_samples)};
  for (std::size_t i = 0; i < first.data.size(); ++i) {
    const double difference = first.data[i] - second.data[i];
    joined.difference.data[i] = difference;
    joined.image.data[i] = second.data[i] + joined.first * difference;
  }
  return joined;
}

LossEstimate estimate_loss(const SplitImage& image, const GatedImage& target, const RobustLoss& rho) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (!image.halved()) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const double first = image.first, second = 1 - first;
  const std::size_t values = target.data.size(), per_pixel = values / static_cast<std::size_t>(target.pixels());
  PixelSums loss, squared;
  for (std::size_t i = 0; i < values; ++i) {
    const double r = image.image.data[i] - target.data[i], d = image.difference.data[i];
    // Halves of unequal size add a term whose expectation is 0: so the squared loss is their product exactly.
    const double slope = 2 * rho.weight(r) * r, variance = first * second * d * d, odd = (second - first) / 2 * d;
    loss.add(rho.value(r) + odd * slope - rho.second(r) / 2 * variance, slope * d / 2);
    squared.add((r + second * d) * (r - first * d), r * d);
    if ((i + 1) % per_pixel == 0) {
      loss.end_pixel();
      squared.end_pixel();
    }
  }
  if (!std::isfinite(loss.value()) || !std::isfinite(squared.value())) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const auto n = static_cast<double>(values);
  const int pixels = target.pixels();
  return {loss.value() / n, loss.standard_error(pixels) / n, squared.value() / n, squared.standard_error(pixels) / n};
}

GatedImage loss_adjoint(const SplitImage& image, const GatedImage& target, const RobustLoss& rho) {
  GatedImage adjoint = loss_adjoint(image.image, target, rho);
  if (rho.kind != LossKind::cauchy || !image.halved()) return adjoint;  // rho''' is 0, or v unknown
  const double variance = image.first * (1 - image.first), n = static_cast<double>(target.data.size());
  for (std::size_t i = 0; i < adjoint.data.size(); ++i) {
    const double r = image.image.data[i] - target.data[i], d = image.difference.data[i];
    adjoint.data[i] -= rho.third(r) / 2 * variance * d * d / n;
  }
  return adjoint;
}

GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const RobustLoss& rho) {
  GatedImage adjoint = image;
  const double scale = 2.0 / static_cast<double>(image.data.size());
  for (std::size_t i = 0; i < adjoint.data.size(); ++i) {
    const double residual = image.data[i] - target.data[i];
    adjoint.data[i] = scale * rho.weight(residual) * residual;
  }
  return adjoint;
}

double root_mean_square_error(double mean_squared_error) {
  return mean_squared_error <= 0 ? 0 : std::sqrt(mean_squared_error);
}

double mean_square(const GatedImage& image) {
  return inner_product(image, image) / static_cast<double>(image.data.size());
}

double inner_product(const GatedImage& a, const GatedImage& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += a.data[i] * b.data[i];
  return sum;
}

}  // namespace isochron
