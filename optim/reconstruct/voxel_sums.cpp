#include "optim/reconstruct/voxel_sums.h"

namespace isochron {

void sum_over_histograms(const Histograms& histograms, const FilteredHistograms& filtered, const TimeFilter& filter,
                         SummedVoxels& voxels) {
  voxels.sum.fill(0);
  voxels.variance.fill(0);
  voxels.squares.fill(0);
  voxels.response.fill(0);
  Arrivals arrivals;
  for (std::size_t row = 0; row < histograms.rows.size(); ++row) {
    const double first = (filter.delay - histograms.rows[row].start) / histograms.bin - filtered.first();
    arrivals.set(voxels, histograms, row, static_cast<float>(first), static_cast<float>(filtered.steps()));
    const FilteredHistograms::Entry* entries = filtered.row(row);
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      voxels.response[i] += arrivals.weight[i];
      const FilteredHistograms::Entry& e = entries[arrivals.entry[i]];
      const float value = e.value + arrivals.along[i] * e.value_step;
      voxels.sum[i] += value;
      voxels.squares[i] += value * value;
      voxels.variance[i] += e.variance + arrivals.along[i] * e.variance_step;
    }
  }
}

}  // namespace isochron
