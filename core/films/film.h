// Where sinks add values of gated images up.
#pragma once
#include <bit>
#include <cstddef>

#include "core/base/listed_sum.h"
#include "core/image/image.h"

namespace isochron {

/// Pixels that a partition of a pass takes at a turn.
inline constexpr int kPixelsPerBlock = 8;

/// The place of a pixel among those of the partitions that have the same blocks of pixels; 2^log_parts sets of blocks take
/// turns.
inline int place_in_part(int pixel, int log_parts) {
  return (pixel / kPixelsPerBlock >> log_parts) * kPixelsPerBlock + pixel % kPixelsPerBlock;
}

/// Where the values of a gated image are added up: in the image itself, or in a part of a long sum. What it refers to must
/// outlive it.
class Film {
 public:
  Film(GatedImage& image) : channels_(image.channels), gates_(image.gates), values_(image.data.data()) {}
  /// An image of so many gates and channels in a sum, where its values begin at `offset`; or only the pixels of one of `parts`
  /// sets, see place_in_part().
  Film(int gates, int channels, ListedSum& sum, std::size_t offset, int parts = 1)
      : channels_(channels),
        gates_(gates),
        log_parts_(std::bit_width(static_cast<unsigned>(parts)) - 1),
        sum_(&sum),
        offset_(offset) {}

  int channels() const { return channels_; }
  /// The values of all channels of a gate and of those after it, up to GateSet::kRun gates in all; to be added to until this is
  /// called again.
  double* at(int pixel, int gate, int count = 1) const {
    if (values_) return values_ + index(pixel, gate);
    return sum_->at(offset_ + index(place_in_part(pixel, log_parts_), gate), count * channels_);
  }

 private:
  std::size_t index(int pixel, int gate) const { return (static_cast<std::size_t>(pixel) * gates_ + gate) * channels_; }

  int channels_, gates_, log_parts_ = 0;
  double* values_ = nullptr;
  ListedSum* sum_ = nullptr;
  std::size_t offset_ = 0;
};

}  // namespace isochron
