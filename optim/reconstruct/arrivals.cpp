#include "optim/reconstruct/arrivals.h"

#include <cmath>

namespace isochron {

void Arrivals::Leg::set(const VoxelBlock& block, const Vec3& from) {
  const float x = static_cast<float>(from.x), y = static_cast<float>(from.y), z = static_cast<float>(from.z);
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    const float dx = block.across[i] - x, dy = block.up[i] - y, dz = block.depth[i] - z;
    const float square = dx * dx + dy * dy + dz * dz, r = std::sqrt(square);
    distance[i] = r;
    factor[i] = dz / (square * r);
  }
}

void Arrivals::set(const VoxelBlock& block, const Histograms& histograms, std::size_t row, float first, float last) {
  const Histograms::Row& of = histograms.rows[row];
  back_.set(block, of.sensor);
  if (of.spot >= 0 && (of.spot != spot_ || &block != block_)) there_.set(block, histograms.spots[of.spot]);
  spot_ = of.spot;
  block_ = &block;
  const Leg& to = of.spot < 0 ? back_ : there_;
  const float per_length = static_cast<float>(1 / histograms.bin);
  for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
    const float bins = (back_.distance[i] + to.distance[i]) * per_length + first;
    // Numbers in place of branches, which compilers do not vectorise.
    const float counts = static_cast<float>(bins >= 0) * static_cast<float>(bins < last);
    const float at = counts * bins + (1 - counts) * last;
    const int whole = static_cast<int>(at);
    entry[i] = whole;
    along[i] = at - static_cast<float>(whole);
    weight[i] = counts * (back_.factor[i] * to.factor[i]);
  }
}

}  // namespace isochron
