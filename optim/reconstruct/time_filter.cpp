#include "optim/reconstruct/time_filter.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/base/parallel.h"

namespace isochron {
namespace {

constexpr double kReach = 4;  // standard deviations: what the filter has beyond is 0.5 % of its maximum

/// Times at which f falls below half of its maximum, found outwards from the maximum in small steps.
struct Peak {
  double at, width;
};
template <class F>
Peak find_peak(F&& f, double low, double high, int steps) {
  const double step = (high - low) / steps;
  std::vector<double> values(steps + 1);
  for (int i = 0; i <= steps; ++i) values[i] = f(low + i * step);
  const int top = static_cast<int>(std::max_element(values.begin(), values.end()) - values.begin());
  const double half = 0.5 * values[top];
  const auto crossing = [&](int direction) {
    int i = top;
    while (i + direction >= 0 && i + direction <= steps && values[i + direction] >= half) i += direction;
    if (i + direction < 0 || i + direction > steps) return low + i * step;
    return low + step * (i + direction * (values[i] - half) / (values[i] - values[i + direction]));
  };
  return {low + top * step, crossing(1) - crossing(-1)};
}

/// Weights of the bins from -reach to reach, sigma in bins.
std::vector<double> bin_weights(double sigma) {
  const int reach = static_cast<int>(std::ceil(kReach * sigma));
  std::vector<double> result;
  for (int i = -reach; i <= reach; ++i) {
    const double x = i / sigma;
    result.push_back((1 - x * x) * std::exp(-0.5 * x * x));
  }
  return result;
}

/// What the filter makes of the counts around a bin. Of the bins that there are, the mean weight is taken away: what is the same
/// in all of them leaves nothing.
FilteredHistograms::Entry filtered_at(const float* counts, int bins, int at, const std::vector<double>& weights) {
  const int reach = static_cast<int>(weights.size() / 2), first = std::max(0, at - reach),
            last = std::min(bins - 1, at + reach);
  const double* weight = &weights[reach - at];
  double mean = 0, value = 0, variance = 0;
  for (int i = first; i <= last; ++i) mean += weight[i] / (last - first + 1);
  for (int i = first; i <= last; ++i) {
    const double w = weight[i] - mean;
    value += w * counts[i];
    variance += w * w * std::abs(counts[i]);
  }
  return {static_cast<float>(value), static_cast<float>(variance)};
}

}  // namespace

double response_deviation(const DetectorResponse& response, double bin) {
  constexpr int kSteps = 4000;
  const double of_gaussian = 2 * std::sqrt(2 * std::numbers::ln2);
  double width = 0;
  if (response) {
    // Its maximum is at a knot. A long table has dark counts far from it, between which a peak would be missed.
    const std::vector<LinearDensity::Knot>& knots = response->knots();
    const auto top = std::ranges::max_element(knots, {}, &LinearDensity::Knot::value);
    const auto below_half = [&](const LinearDensity::Knot& knot) { return knot.value < 0.5 * top->value; };
    const auto after = std::find_if(top, knots.end(), below_half);
    const auto before = std::find_if(std::make_reverse_iterator(top), knots.rend(), below_half);
    const double low = before == knots.rend() ? response->lower() : before->offset,
                 high = after == knots.end() ? response->upper() : after->offset;
    width = find_peak([&](double t) { return response->cumulated(t).value; }, low, high, kSteps).width;
  }
  return std::hypot(width / of_gaussian, bin / std::sqrt(12.0));
}

TimeFilter time_filter(double sigma, const DetectorResponse& response, double bin) {
  // Filter and bin together are differences of the gaussian's first derivative; the response is cut into even pieces.
  const auto slope = [sigma](double x) { return x * std::exp(-0.5 * x * x / (sigma * sigma)); };
  const auto instant = [&](double x) { return slope(x + 0.5 * bin) - slope(x - 0.5 * bin); };
  const double low = response ? response->lower() : 0, high = response ? response->upper() : 0;
  const int pieces = response ? static_cast<int>(std::ceil(20 * (high - low) / sigma)) : 0;
  std::vector<double> share(pieces);
  for (int i = 0; i < pieces; ++i) {
    const auto below = [&](int k) { return response->cumulated(low + (high - low) * k / pieces).below; };
    share[i] = below(i + 1) - below(i);
  }
  const auto filtered = [&](double x) {
    if (!response) return instant(x);
    // Beyond, the filter's slope has less than 1e-16 of its largest.
    const double reach = 9 * sigma + bin, per_length = pieces / (high - low);
    const int first = static_cast<int>(std::clamp((x - reach - low) * per_length, 0.0, 1.0 * pieces)),
              last = static_cast<int>(std::clamp((x + reach - low) * per_length + 1, 0.0, 1.0 * pieces));
    double sum = 0;
    for (int i = first; i < last; ++i) sum += share[i] * instant(x - (low + (high - low) * (i + 0.5) / pieces));
    return sum;
  };
  const double from = low - 3 * sigma, to = high + 3 * sigma;
  const Peak peak = find_peak(filtered, from, to, static_cast<int>(std::ceil(100 * (to - from) / sigma)));
  return {sigma, peak.at, peak.width};
}

FilteredHistograms::FilteredHistograms(const Histograms& histograms, const TimeFilter& filter)
    : first_(margin(filter.sigma, histograms.bin)), entries_(std::max(0, histograms.bins - 2 * first_)) {
  const std::vector<double> weights = bin_weights(filter.sigma / histograms.bin);
  values_.resize(histograms.rows.size() * stride());
  parallel(static_cast<int>(histograms.rows.size()), [&](int i) {
    Entry* row = &values_[i * stride()];
    for (int k = 0; k < entries_; ++k) row[k] = filtered_at(histograms.of(i), histograms.bins, first_ + k, weights);
    for (int k = 0; k + 1 < entries_; ++k) {
      row[k].value_step = row[k + 1].value - row[k].value;
      row[k].variance_step = row[k + 1].variance - row[k].variance;
    }
    row[steps()] = Entry();
  });
}

int FilteredHistograms::margin(double sigma, double bin) {
  return static_cast<int>(std::ceil(2 * sigma / bin));
}

}  // namespace isochron
