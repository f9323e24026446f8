#include "core/films/replicates.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace isochron {
std::vector<double> shares(const std::vector<double>& samples) {
  const double sum = std::accumulate(samples.begin(), samples.end(), 0.0);
  std::vector<double> result;
  for (double n : samples) result.push_back(n / sum);
  return result;
}

GateSums::GateSums(int gates, int channels, std::vector<double> weight)
    : channels_(channels), weight_(std::move(weight)), sums_(gates * weight_.size(), 0.0), deviations_(gates) {}

void GateSums::add(int gate, const double* values, std::size_t stride, double* mean) {
  const std::size_t replicates = weight_.size();
  const auto grey = [&](std::size_t r) {
    double sum = 0;
    for (int c = 0; c < channels_; ++c) sum += values[r * stride + c];
    return sum / channels_;
  };
  for (int c = 0; c < channels_; ++c) {
    mean[c] = 0;
    for (std::size_t r = 0; r < replicates; ++r) mean[c] += weight_[r] * values[r * stride + c];
  }
  for (std::size_t r = 0; r < replicates; ++r) sums_[gate * replicates + r] += grey(r);
  deviations_[gate].add(weight_, grey);
}

void ReplicatedPixel::finish(int pixel, GateSums& sums, StoredImage& mean) {
  constexpr std::size_t kMostChannels = 3;
  std::sort(gates_.begin(), gates_.end());
  entries_.clear();
  for (const int gate : gates_) {
    double of_gate[kMostChannels];
    const std::size_t first = gate * channels_;
    sums.add(gate, &rows_[first], values_, of_gate);
    for (std::size_t c = 0; c < channels_; ++c) {
      const auto value = static_cast<float>(of_gate[c]);
      if (value != 0) entries_.push_back({static_cast<std::uint32_t>(first + c), value});
      for (std::size_t r = 0; r < sums.weight().size(); ++r) rows_[r * values_ + first + c] = 0;
    }
    touched_[gate] = 0;
  }
  gates_.clear();
  mean.set(pixel, entries_);
}

void GateSums::add(const GateSums& other) {
  for (std::size_t i = 0; i < sums_.size(); ++i) sums_[i] += other.sums_[i];
  for (std::size_t g = 0; g < deviations_.size(); ++g) deviations_[g].add(other.deviations_[g]);
}

void GateSums::pack(Packer& packer) const {
  packer.put(channels_);
  packer.put(weight_);
  packer.put(sums_);
  packer.put(deviations_);
}

void GateSums::unpack(Unpacker& unpacker) {
  unpacker.get(channels_);
  unpacker.get(weight_);
  unpacker.get(sums_);
  unpacker.get(deviations_);
}

}  // namespace isochron
