// Sums of filtered counts over all ways to a voxel and back.
#pragma once
#include "optim/reconstruct/arrivals.h"
#include "optim/reconstruct/time_filter.h"

namespace isochron {

struct SummedVoxels : VoxelBlock {
  Values sum;       ///< of filtered counts
  Values variance;  ///< of that, by the counts' own
  Values squares;   ///< of the filtered counts, summed: the variance, were the signs of all a matter of chance
  Values response;  ///< what a small diffuse patch would send back: the sum of Arrivals::weight over all histograms
};

/// Fills in sums at the voxels' places.
void sum_over_histograms(const Histograms& histograms, const FilteredHistograms& filtered, const TimeFilter& filter,
                         SummedVoxels& voxels);

}  // namespace isochron
