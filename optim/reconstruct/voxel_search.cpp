#include "optim/reconstruct/voxel_search.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/base/parallel.h"
#include "optim/reconstruct/significance.h"

namespace isochron {
namespace {

constexpr int kSide = VoxelBlock::kSide;
constexpr double kMostWork = 1e9;  // sums that the coarsest level may take: some three seconds of a core

struct Level {
  int number;
  Histograms histograms;
  TimeFilter filter;
};

/// Points within a group differ in their ways by no more than half of the filter's standard deviation, rms: two ways, squares.
Level level(int number, const Histograms& histograms, const DetectorResponse& response, double sigma) {
  const double side = std::sqrt(12.0) / 4 * std::ldexp(sigma, number);
  return {number, number > 0 ? grouped(histograms, side) : histograms,
          time_filter(std::ldexp(sigma, number), response, histograms.bin)};
}

/// Levels that take no more than that work, as long as the filter fits into the bins.
std::vector<Level> levels(const Histograms& histograms, const DetectorResponse& response, double sigma,
                          const SearchRegion& region) {
  std::vector<Level> result{level(0, histograms, response, sigma)};
  const auto work = [&] {
    return region.voxels(result.back().number) * static_cast<double>(result.back().histograms.rows.size());
  };
  const auto fits = [&](int number) {
    return 4 * FilteredHistograms::margin(std::ldexp(sigma, number), histograms.bin) < histograms.bins;
  };
  while (work() > kMostWork && fits(result.back().number + 1))
    result.push_back(level(result.back().number + 1, histograms, response, sigma));
  return result;
}

std::vector<VoxelPlace> all_blocks(const SearchRegion& region, int level) {
  VoxelPlace first, end;
  for (int axis = 0; axis < 3; ++axis) {
    const double side = std::ldexp(region.step[axis], level) * kSide;
    first[axis] = static_cast<int>(std::floor(region.low[axis] / side));
    end[axis] = static_cast<int>(std::ceil(region.high[axis] / side));
  }
  std::vector<VoxelPlace> blocks;
  for (int a = first[0]; a < end[0]; ++a) {
    for (int u = first[1]; u < end[1]; ++u) {
      for (int d = first[2]; d < end[2]; ++d) blocks.push_back({a, u, d});
    }
  }
  return blocks;
}

std::vector<SummedBlock> sums(const Level& level, const SearchRegion& region, const std::vector<VoxelPlace>& blocks) {
  const FilteredHistograms filtered(level.histograms, level.filter);
  std::vector<SummedBlock> result(blocks.size());
  parallel(static_cast<int>(blocks.size()), [&](int b) {
    result[b].place = blocks[b];
    const auto block = std::make_unique<SummedVoxels>();
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const VoxelPlace voxel = result[b].voxel(i);
      const auto middle = [&](int axis) {
        return static_cast<float>(std::ldexp(region.step[axis], level.number) * (voxel[axis] + 0.5));
      };
      block->across[i] = middle(0);
      block->up[i] = middle(1);
      block->depth[i] = middle(2);
    }
    sum_over_histograms(level.histograms, filtered, level.filter, *block);
    result[b].sum = block->sum;
    result[b].variance = block->variance;
    result[b].squares = block->squares;
    result[b].response = block->response;
  });
  return result;
}

SearchLimits search_limits(const std::vector<SummedBlock>& blocks, double noise) {
  long count = 0;
  for (const SummedBlock& block : blocks) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) count += std::abs(block.significance(i, 0)) >= noise;
  }
  return {noise, count > 2 ? normal_quantile_above(1.0 / static_cast<double>(count)) : 0};
}

AlbedoScale albedo_scale(const std::vector<SummedBlock>& blocks, const SearchLimits& limits) {
  std::vector<std::pair<float, float>> significant;  // sum and response
  for (const SummedBlock& block : blocks) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      if (std::abs(block.significance(i, limits.chance)) >= limits.noise)
        significant.emplace_back(block.sum[i], block.response[i]);
    }
  }
  AlbedoScale scale;
  if (significant.empty()) return scale;
  const auto threshold = [&](auto&& value) {
    std::vector<float> values;
    for (const auto& [sum, response] : significant) values.push_back(static_cast<float>(value(sum, response)));
    return surface_threshold(std::move(values));
  };
  const auto [most, response] = *std::max_element(significant.begin(), significant.end());
  if (most > 0) scale.weak = response * threshold([](float sum, float) { return sum; }) / most;
  scale.least = threshold([&](float sum, float r) { return scale.of(sum, r); });
  return scale;
}

/// Blocks of the next finer level that hold the voxels of significant ones, and those next to these.
std::vector<VoxelPlace> finer_blocks(const std::vector<SummedBlock>& coarse, const SearchLimits& limits,
                                     const AlbedoScale& albedo, double least_albedo) {
  const auto block_of = [](int voxel) { return static_cast<int>(std::floor(static_cast<double>(voxel) / kSide)); };
  std::vector<VoxelPlace> blocks;
  for (const SummedBlock& block : coarse) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      if (std::abs(block.significance(i, limits.chance)) < limits.noise) continue;
      if (std::abs(albedo.of(block.sum[i], block.response[i])) < least_albedo) continue;
      const VoxelPlace voxel = block.voxel(i);
      VoxelPlace first, last;
      for (int axis = 0; axis < 3; ++axis) {
        first[axis] = block_of(2 * voxel[axis] - 2);
        last[axis] = block_of(2 * voxel[axis] + 3);
      }
      for (int a = first[0]; a <= last[0]; ++a) {
        for (int u = first[1]; u <= last[1]; ++u) {
          for (int d = std::max(0, first[2]); d <= last[2]; ++d) blocks.push_back({a, u, d});
        }
      }
    }
  }
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

}  // namespace

double SearchRegion::voxels(int level) const {
  double count = 1;
  for (int i = 0; i < 3; ++i) count *= std::ceil((high[i] - low[i]) / std::ldexp(step[i], level));
  return count;
}

SearchRegion reached_region(const Histograms& histograms, const TimeFilter& filter) {
  SearchRegion region{histograms.rows[0].sensor, histograms.rows[0].sensor, {}};
  const auto include = [&](const Vec3& p) {
    for (int i = 0; i < 2; ++i) {
      region.low[i] = std::min(region.low[i], p[i]);
      region.high[i] = std::max(region.high[i], p[i]);
    }
  };
  double longest = 0;
  for (const Histograms::Row& row : histograms.rows) {
    include(row.sensor);
    longest = std::max(longest, row.start + histograms.bins * histograms.bin - filter.delay);
  }
  for (const Vec3& spot : histograms.spots) include(spot);
  for (int i = 0; i < 2; ++i) {
    region.low[i] -= 0.5 * longest;
    region.high[i] += 0.5 * longest;
  }
  region.low.z = 0;
  region.high.z = 0.5 * longest;
  return region;
}

double SummedBlock::significance(int i, double chance) const {
  if (!(variance[i] > 0) || std::abs(sum[i]) < chance * std::sqrt(squares[i])) return 0;
  return sum[i] / std::sqrt(variance[i]);
}

VoxelPlace SummedBlock::voxel(int i) const {
  return {place[0] * kSide + i % kSide, place[1] * kSide + i / kSide % kSide, place[2] * kSide + i / (kSide * kSide)};
}

SearchResult search(const Histograms& histograms, const DetectorResponse& response, double sigma,
                    const SearchRegion& region, double least) {
  const std::vector<Level> all = levels(histograms, response, sigma, region);
  SearchResult result;
  std::vector<VoxelPlace> places = all_blocks(region, all.back().number);
  for (auto level = all.rbegin(); level != all.rend(); ++level) {
    result.blocks = sums(*level, region, places);
    result.limits = search_limits(result.blocks, least * std::exp2(-0.5 * level->number));
    result.albedo = albedo_scale(result.blocks, result.limits);
    // A surface as wide as a finest voxel fills a quarter of what a voxel of the next level sees of a plane, and so on.
    const double filled = std::exp2(-2.0 * level->number);
    if (level->number > 0)
      places = finer_blocks(result.blocks, result.limits, result.albedo, filled * result.albedo.least);
  }
  return result;
}

}  // namespace isochron
