#include "optim/problem/statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/student.h"

namespace isochron {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// Deviations of `replicates` values from their mean are as if of one less.
double effective_count(const Deviations& deviations, std::size_t replicates) {
  const double n = static_cast<double>(replicates);
  if (!(deviations.squares > 0)) return kInfinity;
  return static_cast<double>(deviations.squares * (deviations.squares / deviations.fourth_powers) * (n - 1) / n);
}

/// Variance of the weighted mean, from the sum of the squares of its weighted deviations.
double variance(double squares, std::size_t replicates) {
  const double n = static_cast<double>(replicates);
  return squares * n / (n - 1);
}

/// Satterthwaite's formula, 2 (sum of variances)^2 / (sum of their squares), with the squares of the estimated variances in
/// place of those of the true ones. These are larger (three times for two normal replicates), so that the degrees come out
/// too few rather than too many.
double degrees_of(double effective_count, double most) {
  return std::isinf(effective_count) ? kInfinity : std::clamp(2 * effective_count, 1.0, most);
}

void append(Statistics& result, double mean, double squares_of_mean, std::size_t replicates, double effective_count,
            double most_degrees) {
  result.mean.push_back(mean);
  result.standard_error.push_back(std::sqrt(variance(squares_of_mean, replicates)));
  const bool varies = squares_of_mean > 0;
  result.degrees.push_back(varies ? degrees_of(effective_count, most_degrees) : kInfinity);
  result.effective_count.push_back(varies ? effective_count : kInfinity);
}

}  // namespace

double Statistics::half_width_95(std::size_t i) const {
  return standard_error[i] > 0 ? standard_error[i] * student_quantile_95(degrees[i]) : 0;
}

void ReplicateStatistics::add(const std::vector<double>& replicate, int samples) {
  replicates_.push_back(replicate);
  samples_.push_back(samples);
}

void ReplicateStatistics::add(const std::vector<double>& replicate, std::vector<std::vector<double>> parts,
                              int samples) {
  add(replicate, samples);
  parts_.push_back(std::move(parts));
}

Statistics ReplicateStatistics::result() const {
  const std::vector<double> weight = shares(samples_);
  const std::size_t count = weight.size();
  const bool has_parts = parts_.size() == count && !parts_.front().empty();
  Statistics result;
  result.replicates = static_cast<int>(count);
  for (std::size_t i = 0; i < replicates_.front().size(); ++i) {
    Deviations whole, of_parts;
    const double mean = whole.add(weight, [&](std::size_t r) { return replicates_[r][i]; });
    if (has_parts)
      for (std::size_t p = 0; p < parts_.front().size(); ++p)
        of_parts.add(weight, [&](std::size_t r) { return parts_[r][p][i]; });
    append(result, mean, whole.squares, count, effective_count(has_parts ? of_parts : whole, count),
           static_cast<double>(count - 1));
  }
  return result;
}

void ImageStatistics::add(GatedImage image, int samples) {
  images_.push_back(std::move(image));
  samples_.push_back(samples);
}

GatedImage ImageStatistics::mean() const {
  const std::vector<double> weight = shares(samples_);
  GatedImage mean(images_[0].width, images_[0].height, images_[0].gates, images_[0].channels);
  for (std::size_t r = 0; r < images_.size(); ++r)
    for (std::size_t i = 0; i < mean.data.size(); ++i) mean.data[i] += weight[r] * images_[r].data[i];
  return mean;
}

Statistics ImageStatistics::gates() const {
  const GatedImage& first = images_.front();
  GateSums sums(first.gates, first.channels, shares(samples_));
  std::vector<double> values(first.channels * images_.size()), mean(first.channels);
  for (int pixel = 0; pixel < first.pixels(); ++pixel)
    for (int g = 0; g < first.gates; ++g) {
      for (std::size_t r = 0; r < images_.size(); ++r)
        std::copy_n(&images_[r].data[first.index(pixel, g)], first.channels, &values[r * first.channels]);
      sums.add(g, values.data(), first.channels, mean.data());
    }
  return gate_statistics(sums, first.pixels(), independent_);
}

Statistics gate_statistics(const GateSums& sums, int pixels, bool pixels_are_independent) {
  const std::size_t count = sums.weight().size();
  const double n = pixels;
  Statistics result;
  result.replicates = static_cast<int>(count);
  for (int g = 0; g < sums.gates(); ++g) {
    Deviations whole;
    const double mean = whole.add(sums.weight(), [&](std::size_t r) { return sums.sum(g, r) / n; });
    const Deviations& of_pixels = sums.deviations(g);
    append(result, mean, pixels_are_independent ? of_pixels.squares / (n * n) : whole.squares, count,
           effective_count(of_pixels, count), (pixels_are_independent ? n : 1) * static_cast<double>(count - 1));
  }
  return result;
}

Statistics sum_of(const std::vector<const Statistics*>& terms) {
  Statistics sum = *terms.front();
  for (std::size_t i = 0; i < sum.mean.size(); ++i) {
    double error = 0, of_degrees = 0, of_counts = 0;
    sum.mean[i] = 0;
    for (const Statistics* term : terms) {
      sum.mean[i] += term->mean[i];
      error = std::hypot(error, term->standard_error[i]);
    }
    for (const Statistics* term : terms) {
      if (!(term->standard_error[i] > 0)) continue;
      const double fraction = std::pow(term->standard_error[i] / error, 4);
      of_degrees += fraction / term->degrees[i];
      of_counts += fraction / term->effective_count[i];
    }
    sum.standard_error[i] = error;
    sum.degrees[i] = of_degrees > 0 ? 1 / of_degrees : kInfinity;
    sum.effective_count[i] = of_counts > 0 ? 1 / of_counts : kInfinity;
  }
  for (const Statistics* term : terms) sum.replicates = std::min(sum.replicates, term->replicates);
  return sum;
}

int replicate_count(int samples, int pixels, bool pixels_are_independent, int most) {
  constexpr int kMost = 32;
  const int for_pixels = 1 + (kMost - 2 + pixels) / pixels;  // (replicates - 1) * pixels >= 31
  return std::min({std::max(pixels_are_independent ? 2 : most, for_pixels), kMost, samples});
}

}  // namespace isochron
