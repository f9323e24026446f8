#include "optim/problem/loss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

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
  /// Of the sum.
  double standard_error(double pixels) const {
    const double scatter = squared_values_ - value_ * value_ / pixels;
    return std::sqrt(std::max(0.0, std::min(squared_errors_, scatter)));
  }

 private:
  double value_ = 0, squared_values_ = 0, squared_errors_ = 0, pixel_value_ = 0, pixel_error_ = 0;
};

/// Integral of (m - N) / max(m, floor) over m, from `from` to `to`, both on one side of the floor.
double half_deviance_part(double from, double to, double count, double floor) {
  if (std::min(from, to) >= floor) return to - from - (count > 0 ? count * std::log(to / from) : 0);
  return (to - from) * ((to + from) / 2 - count) / floor;
}

double half_deviance(double mean, double count, double floor) {
  if ((mean >= floor) == (count >= floor)) return half_deviance_part(count, mean, count, floor);
  return half_deviance_part(count, floor, count, floor) + half_deviance_part(floor, mean, count, floor);
}

}  // namespace

double ReadingLoss::value(double image, double target) const {
  if (kind == LossKind::poisson) return half_deviance(image, target, scale);
  const double r = image - target;
  if (kind == LossKind::huber && std::abs(r) > scale) return scale * (2 * std::abs(r) - scale);
  if (kind == LossKind::cauchy) return scale * scale * std::log1p((r / scale) * (r / scale));
  return r * r;
}

double ReadingLoss::weight(double image, double target) const {
  if (kind == LossKind::poisson) return 0.5 / std::max(image, scale);
  const double r = image - target;
  if (kind == LossKind::huber && std::abs(r) > scale) return scale / std::abs(r);
  if (kind == LossKind::cauchy) return 1 / (1 + (r / scale) * (r / scale));
  return 1;
}

double ReadingLoss::second(double image, double target) const {
  if (kind == LossKind::poisson) return image > scale ? target / (image * image) : 1 / scale;
  const double r = image - target;
  if (kind == LossKind::huber && std::abs(r) > scale) return 0;
  if (kind == LossKind::cauchy) {
    const double t = (r / scale) * (r / scale);
    return 2 * (1 - t) / ((1 + t) * (1 + t));
  }
  return 2;
}

double ReadingLoss::third(double image, double target) const {
  if (kind == LossKind::poisson) return image > scale ? -2 * target / (image * image * image) : 0;
  if (kind != LossKind::cauchy) return 0;
  const double x = (image - target) / scale, t = x * x;
  return -4 * x * (3 - t) / ((1 + t) * (1 + t) * (1 + t)) / scale;
}

SplitImage join_halves(GatedImage first, int first_samples, GatedImage second, int second_samples) {
  const double part = static_cast<double>(first_samples) / (first_samples + second_samples);
  for (std::size_t i = 0; i < first.data.size(); ++i) {
    first.data[i] -= second.data[i];
    second.data[i] += part * first.data[i];
  }
  return {std::move(second), std::move(first), part};
}

LossEstimate estimate_loss(const SplitImage& image, const GatedImage& target, const ReadingLoss& rho) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (!image.halved()) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const double first = image.first, second = 1 - first;
  PixelSums loss, squared;
  for (int pixel = 0; pixel < target.pixels(); ++pixel) {
    for_each_reading(target, rho.readings, pixel, [&](std::size_t i) {
      const double m = image.image.data[i], t = target.data[i], r = m - t, d = image.difference.data[i];
      // Halves of unequal size add a term whose expectation is 0: so the squared loss is their product exactly.
      const double slope = 2 * rho.weight(m, t) * r, variance = first * second * d * d, odd = (second - first) / 2 * d;
      loss.add(rho.value(m, t) + odd * slope - rho.second(m, t) / 2 * variance, slope * d / 2);
      squared.add((r + second * d) * (r - first * d), r * d);
    });
    loss.end_pixel();
    squared.end_pixel();
  }
  if (!std::isfinite(loss.value()) || !std::isfinite(squared.value())) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const double n = rho.readings.count(target), pixels = rho.readings.pixels(target);
  return {loss.value() / n, loss.standard_error(pixels) / n, squared.value() / n, squared.standard_error(pixels) / n};
}

GatedImage loss_adjoint(const SplitImage& image, const GatedImage& target, const ReadingLoss& rho) {
  if (rho.kind == LossKind::poisson && !image.halved())
    throw std::logic_error("the slope of a Poisson likelihood needs two halves of the image's samples");
  GatedImage adjoint = loss_adjoint(image.image, target, rho);
  if ((rho.kind != LossKind::cauchy && rho.kind != LossKind::poisson) || !image.halved())
    return adjoint;  // rho''' is 0, or v unknown
  const double first = image.first, second = 1 - first, n = rho.readings.count(target);
  for (int pixel = 0; pixel < target.pixels(); ++pixel)
    for_each_reading(target, rho.readings, pixel, [&](std::size_t i) {
      const double m = image.image.data[i], t = target.data[i], d = image.difference.data[i];
      const double a = m + second * d, b = m - first * d;  // the halves
      if (rho.kind == LossKind::poisson)
        adjoint.data[i] = 2 * (first * (a - t) * rho.weight(b, t) + second * (b - t) * rho.weight(a, t)) / n;
      else
        adjoint.data[i] -= rho.third(m, t) / 2 * first * second * d * d / n;
    });
  return adjoint;
}

GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const ReadingLoss& rho) {
  GatedImage adjoint(image.width, image.height, image.gates, image.channels);
  const double scale = 2 / rho.readings.count(image);
  for (int pixel = 0; pixel < target.pixels(); ++pixel)
    for_each_reading(target, rho.readings, pixel, [&](std::size_t i) {
      const double m = image.data[i], t = target.data[i];
      adjoint.data[i] = scale * rho.weight(m, t) * (m - t);
    });
  return adjoint;
}

std::vector<double> curvature_weights(const GatedImage& image, const GatedImage& target, const ReadingLoss& rho) {
  std::vector<double> weights(image.data.size(), 0.0);
  const double scale = 2 / rho.readings.count(image);
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    for_each_reading(image, rho.readings, pixel,
                     [&](std::size_t i) { weights[i] = scale * rho.weight(image.data[i], target.data[i]); });
  return weights;
}

double root_mean_square_error(double mean_squared_error) {
  return mean_squared_error <= 0 ? 0 : std::sqrt(mean_squared_error);
}

double mean_square(const GatedImage& image, const Readings& readings) {
  double sum = 0;
  for (int pixel = 0; pixel < image.pixels(); ++pixel)
    for_each_reading(image, readings, pixel, [&](std::size_t i) { sum += image.data[i] * image.data[i]; });
  return sum / readings.count(image);
}

double typical_power(const GatedImage& image, const Readings& readings, int power) {
  std::vector<double> pixels;
  for (int pixel = 0; pixel < image.pixels(); ++pixel) {
    double sum = 0;
    int count = 0;
    for_each_reading(image, readings, pixel, [&](std::size_t i) {
      sum += std::pow(std::abs(image.data[i]), power);
      ++count;
    });
    if (sum > 0) pixels.push_back(sum / count);
  }
  if (pixels.empty()) return 0;
  const auto middle = pixels.begin() + static_cast<std::ptrdiff_t>(pixels.size() / 2);
  std::nth_element(pixels.begin(), middle, pixels.end());
  return *middle;
}

double inner_product(const GatedImage& a, const GatedImage& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += a.data[i] * b.data[i];
  return sum;
}

}  // namespace isochron
