#include "optim/reconstruct/voxel_sums.h"

#include <cmath>

namespace isochron {
namespace {

using Values = VoxelBlock::Values;

/// Distances from a point of the wall, and cosine / r^2 there.
struct Leg {
  Values distance, factor;

  void set(const VoxelBlock& block, const Vec3& from) {
    const float x = static_cast<float>(from.x), y = static_cast<float>(from.y), z = static_cast<float>(from.z);
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const float dx = block.across[i] - x, dy = block.up[i] - y, dz = block.depth[i] - z;
      const float square = dx * dx + dy * dy + dz * dz, r = std::sqrt(square);
      distance[i] = r;
      factor[i] = dz / (square * r);
    }
  }
};

}  // namespace

void sum_over_histograms(const Histograms& histograms, const FilteredHistograms& filtered, const TimeFilter& filter,
                         VoxelBlock& block) {
  block.sum.fill(0);
  block.variance.fill(0);
  block.squares.fill(0);
  block.response.fill(0);
  Leg back, there;
  std::array<int, VoxelBlock::kVoxels> entry;
  Values along;
  int spot = -1;
  const float per_length = static_cast<float>(1 / histograms.bin), last = static_cast<float>(filtered.steps());
  for (std::size_t row = 0; row < histograms.rows.size(); ++row) {
    const Histograms::Row& of = histograms.rows[row];
    back.set(block, of.sensor);
    if (of.spot >= 0 && of.spot != spot) there.set(block, histograms.spots[of.spot]);
    spot = of.spot;
    const Leg& to = spot < 0 ? back : there;
    const float start = static_cast<float>((filter.delay - of.start) / histograms.bin - filtered.first());
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const float bins = (back.distance[i] + to.distance[i]) * per_length + start;
      const bool reached = bins >= 0 && bins < last;
      const float at = reached ? bins : last;
      entry[i] = static_cast<int>(at);
      along[i] = at - static_cast<float>(entry[i]);
      block.response[i] += reached ? back.factor[i] * to.factor[i] : 0;
    }
    const FilteredHistograms::Entry* entries = filtered.row(row);
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const FilteredHistograms::Entry& e = entries[entry[i]];
      const float value = e.value + along[i] * e.value_step;
      block.sum[i] += value;
      block.squares[i] += value * value;
      block.variance[i] += e.variance + along[i] * e.variance_step;
    }
  }
}

}  // namespace isochron
