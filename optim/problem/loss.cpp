#include "optim/problem/loss.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "core/base/parallel.h"

namespace isochron {
namespace {

/// The sum over a pixel's readings, and what both halves disagree in of it.
struct PixelSum {
  double value = 0, error = 0;

  void add(double reading, double reading_error) {
    value += reading;
    error += reading_error;
  }
};

/// Adds up a mean and its variance over pixels, each of which has values of its own.
class PixelSums {
 public:
  void add(const PixelSum& pixel) {
    value_ += pixel.value;
    squared_values_ += pixel.value * pixel.value;
    squared_errors_ += pixel.error * pixel.error;
  }
  double value() const { return value_; }
  /// Of the sum; of that over all pixels where these are a share of them that was drawn at random.
  double standard_error(double pixels, double drawn) const {
    const double scatter = std::max(0.0, squared_values_ - value_ * value_ / pixels);
    return std::sqrt(std::min(squared_errors_, scatter) + (1 - drawn) * scatter);
  }

 private:
  double value_ = 0, squared_values_ = 0, squared_errors_ = 0;
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
  parallel_ranges(first.data.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      first.data[i] -= second.data[i];
      second.data[i] += part * first.data[i];
    }
  });
  return {std::move(second), std::move(first), part};
}

LossEstimate estimate_loss(const SplitImage& image, const GatedImage& target, const ReadingLoss& rho) {
  constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
  if (!image.halved()) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const double first = image.first, second = 1 - first;
  struct Sums {
    PixelSum loss, squared;
  };
  std::vector<Sums> sums(target.pixels());
  parallel_pixels(target, [&](int pixel) {
    auto& [loss, squared] = sums[pixel];
    for_each_reading(target, rho.readings, pixel, [&](std::size_t i) {
      const double m = image.image.data[i], t = target.data[i], r = m - t, d = image.difference.data[i];
      // Halves of unequal size add a term whose expectation is 0: so the squared loss is their product exactly.
      const double slope = 2 * rho.weight(m, t) * r, variance = first * second * d * d, odd = (second - first) / 2 * d;
      loss.add(rho.value(m, t) + odd * slope - rho.second(m, t) / 2 * variance, slope * d / 2);
      squared.add((r + second * d) * (r - first * d), r * d);
    });
  });
  PixelSums loss, squared;
  for (const Sums& pixel : sums) {
    loss.add(pixel.loss);
    squared.add(pixel.squared);
  }
  if (!std::isfinite(loss.value()) || !std::isfinite(squared.value())) return {kUnknown, kUnknown, kUnknown, kUnknown};
  const double n = rho.readings.count(target), pixels = rho.readings.pixels(target);
  const auto error = [&](const PixelSums& of) { return of.standard_error(pixels, rho.readings.drawn) / n; };
  return {loss.value() / n, error(loss), squared.value() / n, error(squared)};
}

GatedImage loss_adjoint(const SplitImage& image, const GatedImage& target, const ReadingLoss& rho) {
  if (rho.kind == LossKind::poisson && !image.halved())
    throw std::logic_error("the slope of a Poisson likelihood needs two halves of the image's samples");
  if ((rho.kind != LossKind::cauchy && rho.kind != LossKind::poisson) || !image.halved())
    return loss_adjoint(image.image, target, rho);  // rho''' is 0, or v unknown
  GatedImage adjoint(target.width, target.height, target.gates, target.channels);
  const double first = image.first, second = 1 - first, scale = 2 / rho.readings.count(target);
  parallel_pixels(target, [&](int pixel) {
    for_each_reading(target, rho.readings, pixel, [&](std::size_t i) {
      const double m = image.image.data[i], t = target.data[i], d = image.difference.data[i];
      const double a = m + second * d, b = m - first * d;  // the halves
      if (rho.kind == LossKind::poisson)
        adjoint.data[i] = scale * (first * (a - t) * rho.weight(b, t) + second * (b - t) * rho.weight(a, t));
      else
        adjoint.data[i] = scale * (rho.weight(m, t) * (m - t) - rho.third(m, t) / 4 * first * second * d * d);
    });
  });
  return adjoint;
}

GatedImage loss_adjoint(const GatedImage& image, const GatedImage& target, const ReadingLoss& rho) {
  GatedImage adjoint(image.width, image.height, image.gates, image.channels);
  const double scale = 2 / rho.readings.count(image);
  parallel_pixels(target, [&](int pixel) {
    for_each_reading(target, rho.readings, pixel, [&](std::size_t i) {
      const double m = image.data[i], t = target.data[i];
      adjoint.data[i] = scale * rho.weight(m, t) * (m - t);
    });
  });
  return adjoint;
}

std::vector<double> curvature_weights(const GatedImage& image, const GatedImage& target, const ReadingLoss& rho) {
  std::vector<double> weights(image.data.size(), 0.0);
  const double scale = 2 / rho.readings.count(image);
  parallel_pixels(image, [&](int pixel) {
    for_each_reading(image, rho.readings, pixel,
                     [&](std::size_t i) { weights[i] = scale * rho.weight(image.data[i], target.data[i]); });
  });
  return weights;
}

double root_mean_square_error(double mean_squared_error) {
  return mean_squared_error <= 0 ? 0 : std::sqrt(mean_squared_error);
}

double mean_square(const GatedImage& image, const Readings& readings) {
  std::vector<double> pixels(image.pixels(), 0.0);
  parallel_pixels(image, [&](int pixel) {
    for_each_reading(image, readings, pixel, [&](std::size_t i) { pixels[pixel] += image.data[i] * image.data[i]; });
  });
  return std::accumulate(pixels.begin(), pixels.end(), 0.0) / readings.count(image);
}

double typical_power(const GatedImage& image, const Readings& readings, int power) {
  std::vector<double> means(image.pixels(), 0.0);
  parallel_pixels(image, [&](int pixel) {
    double sum = 0;
    int count = 0;
    for_each_reading(image, readings, pixel, [&](std::size_t i) {
      const double value = std::abs(image.data[i]);
      sum += power == 1 ? value : value * value;
      ++count;
    });
    if (sum > 0) means[pixel] = sum / count;
  });
  std::erase(means, 0.0);
  if (means.empty()) return 0;
  const auto middle = means.begin() + static_cast<std::ptrdiff_t>(means.size() / 2);
  std::nth_element(means.begin(), middle, means.end());
  return *middle;
}

double inner_product(const GatedImage& a, const GatedImage& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += a.data[i] * b.data[i];
  return sum;
}

}  // namespace isochron
