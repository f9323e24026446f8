// Coarse to fine: where in the space before a wall sums of filtered counts are significant.
#pragma once
#include <array>
#include <vector>

#include "optim/reconstruct/voxel_sums.h"

namespace isochron {

/// A part of space in the wall's frame, and how it is cut into the finest voxels: number n of an axis has its middle at (n + 1/2)
/// steps. A voxel of level k is 2^k of them wide.
struct SearchRegion {
  Vec3 low, high, step;

  double voxels(int level) const;
};

/// The box that holds all places from which light comes back within the bins.
SearchRegion reached_region(const Histograms& histograms, const TimeFilter& filter);

using VoxelPlace = std::array<int, 3>;  ///< numbers of a voxel or a block: across, up, depth

/// From how many standard deviations on a sum is none of noise, nor of chance.
struct SearchLimits {
  double noise = 0;  ///< by the counts' own Poisson variance
  /// By the sum of the squares of what is summed. Light of surfaces elsewhere comes in time for some points by chance: few with much
  /// light make large sums.
  double chance = 0;
};

struct SummedBlock {
  VoxelPlace place{};  ///< in blocks
  VoxelBlock::Values sum, variance, squares, response;

  /// Standard deviations by the counts' own variance; zero below the limit of chance, in either direction.
  double significance(int i, double chance) const;
  VoxelPlace voxel(int i) const;
};

/// Albedos by sums. Light of surfaces elsewhere makes sums of a size that varies little over the space, so that sum / response would
/// be largest where no surface could be seen. The best estimate beside it is sum * response / (response^2 + weak^2).
struct AlbedoScale {
  double weak = 0;   ///< the response at the largest sum, times the surface_threshold of sums over that sum
  double least = 0;  ///< surface_threshold

  double of(double sum, double response) const {
    return response > 0 ? sum * response / (response * response + weak * weak) : 0;
  }
};

struct SearchResult {
  std::vector<SummedBlock> blocks;  ///< of the finest voxels, by place
  SearchLimits limits;
  AlbedoScale albedo;
};

/// `least`: standard deviations from which on a finest voxel is none of noise. The limit of chance is that which one of those that
/// are not would reach, were they all independent. A filter that is twice as wide lets through twice the background, so that sqrt(2)
/// times less has to do on the next coarser level, and a quarter of the least albedo, as a small surface fills as much less of a voxel.
SearchResult search(const Histograms& histograms, const DetectorResponse& response, double sigma,
                    const SearchRegion& region, double least);

}  // namespace isochron
