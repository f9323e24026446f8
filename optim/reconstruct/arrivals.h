// When light of voxels comes to a histogram, and how much of it.
#pragma once
#include <array>

#include "optim/reconstruct/histograms.h"

namespace isochron {

/// Voxels that are looked at together, in the wall's frame, single precision: it suffices for what counts' noise leaves.
struct VoxelBlock {
  static constexpr int kSide = 8, kVoxels = kSide * kSide * kSide;
  using Values = std::array<float, kVoxels>;

  Values across, up, depth;  ///< where
};

class Arrivals {
 public:
  using Values = VoxelBlock::Values;

  /// From the voxels of `block` to a row of the histograms. Times are in bins, that of the row's first bin's middle at `first`; light
  /// that comes before zero or from `last` on does not count. Calls for one block, by spot, share work: the block must not change.
  void set(const VoxelBlock& block, const Histograms& histograms, std::size_t row, float first, float last);

  std::array<int, VoxelBlock::kVoxels> entry;  ///< whole bins; `last` where light does not count
  Values along;                                ///< what is left of a bin
  /// Of a small diffuse patch that faces nowhere in particular: cosine / r^2 at the wall, on the way to it times on the way back; 0 where
  /// light does not count.
  Values weight;

 private:
  /// Distances from a point of the wall, and cosine / r^2 there.
  struct Leg {
    Values distance, factor;
    void set(const VoxelBlock& block, const Vec3& from);
  };

  Leg back_, there_;
  const VoxelBlock* block_ = nullptr;  ///< that `there_` is of, and its spot
  int spot_ = -1;
};

}  // namespace isochron
