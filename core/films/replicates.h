// What replicates of gated images tell, independent estimates of one thing, each from a part of the samples: their mean, and
// by how much they differ. Pixel after pixel, so that no replicate is kept as a whole.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/ranks.h"
#include "core/image/stored_image.h"

namespace isochron {

/// Sums of the squares and fourth powers of weighted deviations from a mean over replicates.
struct Deviations {
  double squares = 0;
  long double fourth_powers = 0;  ///< for its range of exponents

  /// Adds those of value(0) ... value(n - 1); their weighted mean is returned.
  template <class Value>
  double add(const std::vector<double>& weight, Value&& value) {
    double mean = 0;
    for (std::size_t r = 0; r < weight.size(); ++r) mean += weight[r] * value(r);
    for (std::size_t r = 0; r < weight.size(); ++r) {
      const double d = weight[r] * (value(r) - mean);
      squares += d * d;
      fourth_powers += static_cast<long double>(d) * d * d * d;
    }
    return mean;
  }
  void add(const Deviations& other) {
    squares += other.squares;
    fourth_powers += other.fourth_powers;
  }
};

/// Each replicate's share of the samples.
std::vector<double> shares(const std::vector<double>& samples);

/// Of the averages over channels of each gate, added up over pixels.
class GateSums {
 public:
  GateSums() = default;
  /// `weight`: of each replicate, 1 together.
  GateSums(int gates, int channels, std::vector<double> weight);

  int gates() const { return static_cast<int>(deviations_.size()); }
  int channels() const { return channels_; }
  const std::vector<double>& weight() const { return weight_; }
  /// Of one replicate, over pixels.
  double sum(int gate, std::size_t replicate) const { return sums_[gate * weight_.size() + replicate]; }
  /// Of single pixels.
  const Deviations& deviations(int gate) const { return deviations_[gate]; }

  /// Adds a gate of a pixel, whose values [channel] of the first replicate are at `values`, of each further one `stride` behind
  /// those of the last. What is not added is zero. `mean` becomes their weighted mean.
  void add(int gate, const double* values, std::size_t stride, double* mean);

  void add(const GateSums& other);
  void pack(Packer& packer) const;
  void unpack(Unpacker& unpacker);

 private:
  int channels_ = 0;
  std::vector<double> weight_, sums_;  ///< sums_[gate][replicate]
  std::vector<Deviations> deviations_;
};

/// One pixel of all replicates, of whose values few may be other than zero.
class ReplicatedPixel {
 public:
  explicit ReplicatedPixel(const GateSums& sums)
      : channels_(sums.channels()),
        values_(static_cast<std::size_t>(sums.gates()) * channels_),
        rows_(values_ * sums.weight().size(), 0.0),
        touched_(sums.gates(), 0) {}

  /// To a value at its place [gate][channel].
  void add(std::size_t replicate, std::size_t place, double value) {
    const std::size_t gate = place / channels_;
    if (!touched_[gate]) {
      touched_[gate] = 1;
      gates_.push_back(static_cast<int>(gate));
    }
    rows_[replicate * values_ + place] += value;
  }
  /// Adds the pixel to the sums and sets that of the mean; all is zero afterwards.
  void finish(int pixel, GateSums& sums, StoredImage& mean);

 private:
  const std::size_t channels_, values_;
  std::vector<double> rows_;  ///< [replicate][gate][channel]
  std::vector<std::uint8_t> touched_;
  std::vector<int> gates_;  ///< that were touched
  std::vector<StoredImage::Entry> entries_;
};

/// An image from replicates.
struct ReplicatedImage {
  StoredImage mean;
  GateSums gates;
};

}  // namespace isochron
