// Pixel by pixel: means, standard errors and z-scores of images from independent batches.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/image/image.h"

namespace isochron::testing {

/// Averages over blocks of `size` x `size` pixels: what a sensor with so much larger pixels sees.
inline GatedImage blocks(const GatedImage& image, int size) {
  GatedImage result(image.width / size, image.height / size, image.gates, image.channels);
  const int values = image.gates * image.channels;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int v = 0; v < values; ++v)
        result.data[(y / size * result.width + x / size) * values + v] +=
            image.data[(y * image.width + x) * values + v] / (size * size);
  return result;
}

/// Running mean and variance of every pixel, gate and channel over batches of equal size.
class PixelBatches {
 public:
  void add(const GatedImage& image) {
    if (count_ == 0) mean_ = image, squares_.assign(image.data.size(), 0.0);
    if (count_++ == 0) return;
    for (std::size_t i = 0; i < squares_.size(); ++i) {
      const double d = image.data[i] - mean_.data[i];
      mean_.data[i] += d / count_;
      squares_[i] += d * (image.data[i] - mean_.data[i]);
    }
  }
  const GatedImage& mean() const { return mean_; }
  /// Of the mean: the square of its standard error.
  double variance(std::size_t i) const { return squares_[i] / (count_ - 1.0) / count_; }
  /// Average over pixels, gates and channels.
  double mean_variance() const {
    double sum = 0;
    for (std::size_t i = 0; i < squares_.size(); ++i) sum += variance(i);
    return sum / static_cast<double>(squares_.size());
  }

 private:
  int count_ = 0;
  GatedImage mean_;
  std::vector<double> squares_;
};

/// An image and the variance of every value: a sum of independent estimates.
struct PixelEstimate {
  std::vector<double> mean, variance;

  PixelEstimate& operator+=(const PixelBatches& term) {
    const auto& image = term.mean().data;
    mean.resize(image.size());
    variance.resize(image.size());
    for (std::size_t i = 0; i < image.size(); ++i) mean[i] += image[i], variance[i] += term.variance(i);
    return *this;
  }
  double peak() const {
    double most = 0;
    for (double m : mean) most = std::max(most, std::abs(m));
    return most;
  }
};

/// The z-scores of two independent images agree with the standard normal law if both are unbiased.
struct ZScores {
  std::vector<double> z;      ///< of the values that are not exactly zero in both, without error
  std::vector<double> image;  ///< of all, 0 where the values are
  int zero = 0;               ///< how many are
  double standard_deviation() const {
    double sum = 0;
    for (double x : z) sum += x * x;
    return std::sqrt(sum / static_cast<double>(z.size()));  // about zero, the value that it tests
  }
  double largest() const {
    double most = 0;
    for (double x : z) most = std::max(most, std::abs(x));
    return most;
  }
};

inline ZScores z_scores(const PixelEstimate& a, const PixelEstimate& b) {
  ZScores scores;
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    const double variance = a.variance[i] + b.variance[i], difference = a.mean[i] - b.mean[i];
    if (variance == 0 && difference == 0) {
      ++scores.zero;
      scores.image.push_back(0);
    } else {
      scores.z.push_back(difference / std::sqrt(variance));
      scores.image.push_back(scores.z.back());
    }
  }
  return scores;
}

}  // namespace isochron::testing
