// Sums of filtered counts over all ways to a voxel and back.
#pragma once
#include <array>

#include "optim/reconstruct/time_filter.h"

namespace isochron {

/// Voxels that are summed together, in the wall's frame, single precision: it suffices for what counts' noise leaves.
struct VoxelBlock {
  static constexpr int kSide = 8, kVoxels = kSide * kSide * kSide;
  using Values = std::array<float, kVoxels>;

  Values across, up, depth;  ///< where
  Values sum;                ///< of filtered counts
  Values variance;           ///< of that, by the counts' own
  Values squares;            ///< of the filtered counts, summed: the variance, were the signs of all a matter of chance
  /// What a small diffuse patch that faces nowhere in particular would send back: the sum of cosine / r^2 at the wall, on the way to
  /// it times on the way back, over all histograms whose bins it reaches.
  Values response;
};

/// Fills in sums at the places of the block.
void sum_over_histograms(const Histograms& histograms, const FilteredHistograms& filtered, const TimeFilter& filter,
                         VoxelBlock& block);

}  // namespace isochron
