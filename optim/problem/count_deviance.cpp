#include "optim/problem/count_deviance.h"

#include <algorithm>
#include <cmath>

namespace isochron {
namespace {

/// Of the logarithm of the mean, between entries of the table: linear interpolation is then off by 1e-5 at most.
constexpr double kStep = 0.01;
/// Below, all is in proportion to the mean: two counts are too rare to matter.
constexpr double kRareCounts = 1e-6;
/// Above, the series in 1 / mean is as good as the table.
constexpr double kManyCounts = 1e4;

DevianceMoments mixed(const DevianceMoments& a, const DevianceMoments& b, double t) {
  const auto mix = [t](double x, double y) { return x + t * (y - x); };
  return {mix(a.mean, b.mean),
          mix(a.covariance, b.covariance),
          mix(a.variance, b.variance),
          {mix(a.third[0], b.third[0]), mix(a.third[1], b.third[1]), mix(a.third[2], b.third[2])},
          mix(a.information, b.information)};
}

}  // namespace

CountDeviance::CountDeviance(double floor, double largest) : floor_(floor), first_(std::log(kRareCounts)) {
  const double last = std::log(std::clamp(largest, kRareCounts, kManyCounts));
  for (double y = first_; y < last + 2 * kStep; y += kStep) table_.push_back(exact_moments(std::exp(y)));
}

double CountDeviance::linear(double x) const {
  return x < floor_ ? x * x / (2 * floor_) : x - floor_ / 2;
}

double CountDeviance::logarithm(double x) const {
  return x < floor_ ? x / floor_ : std::log(x / floor_) + 1;
}

double CountDeviance::weight(double x) const {
  return 1 / std::max(x, floor_);
}

double CountDeviance::deviance(double mean, double count) const {
  return 2 * (linear(mean) - linear(count) - count * (logarithm(mean) - logarithm(count)));
}

DevianceMoments CountDeviance::exact_moments(double mean) const {
  DevianceMoments result;
  if (!(mean > 0)) return result;
  // 12 standard deviations and some more for few counts: what lies outside weighs less than rounding.
  const double reach = 12 * std::sqrt(mean) + 24;
  const double begin = std::max(0.0, std::floor(mean - reach)), end = std::ceil(mean + reach);
  const auto each = [&](auto&& f) {
    for (double n = begin; n <= end; ++n) f(n, std::exp(n * std::log(mean) - mean - std::lgamma(n + 1)));
  };
  const auto q = [&](double n) { return n * logarithm(n) - linear(n); };  // D = 2 (q(N) + G(m) - N L(m))
  each([&](double n, double mass) {
    result.mean += mass * deviance(mean, n);
    result.information += mass * mean * (q(n + 2) - 2 * q(n + 1) + q(n));
  });
  each([&](double n, double mass) {
    const double d = deviance(mean, n) - result.mean, e = n - mean;
    result.covariance += mass * d * e;
    result.variance += mass * d * d;
    result.third[0] += mass * d * d * d;
    result.third[1] += mass * d * d * e;
    result.third[2] += mass * d * e * e;
  });
  return result;
}

DevianceMoments CountDeviance::moments(double mean) const {
  if (!(mean > 0)) return {};
  if (mean > kManyCounts) {  // (N - m)^2 / V of a nearly normal number, the first moments corrected to first order
    const double r = mean * weight(mean), off = r == 1 ? 1 / mean : 0;
    return {r + off / 6, -off / 6, 2 * r * r + off * 4 / 3, {8 * r * r * r, 0, 2 * r * mean}, r};
  }
  if (mean < kRareCounts) return mixed({}, table_.front(), mean / kRareCounts);
  const double place = (std::log(mean) - first_) / kStep;
  const auto i = std::min(static_cast<std::size_t>(place), table_.size() - 2);
  return mixed(table_[i], table_[i + 1], place - static_cast<double>(i));
}

}  // namespace isochron
