#include "optim/reconstruct/back_projection.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "optim/problem/memory.h"
#include "optim/reconstruct/significance.h"
#include "optim/reconstruct/voxel_search.h"

namespace isochron {
namespace {

constexpr int kMargin = 4;  // voxels around significant ones: two resolution lengths

/// Half of the optical path at which most points have the most filtered counts: the distance that resolution is judged at.
double distance_of_light(const Histograms& histograms, double sigma, const DetectorResponse& response) {
  const TimeFilter filter = time_filter(sigma, response, histograms.bin);
  const FilteredHistograms filtered(histograms, filter);
  std::vector<double> distances;
  for (std::size_t i = 0; i < histograms.rows.size(); ++i) {
    const FilteredHistograms::Entry* row = filtered.row(i);
    const auto top =
        std::max_element(row, row + filtered.steps(), [](const auto& a, const auto& b) { return a.value < b.value; });
    const double bin = static_cast<double>(top - row) + filtered.first();
    distances.push_back(0.5 * (histograms.rows[i].start + bin * histograms.bin - filter.delay));
  }
  const auto middle = distances.begin() + distances.size() / 2;
  std::nth_element(distances.begin(), middle, distances.end());
  return std::max(*middle, 0.0);
}

/// What decides on the filter and on the size of voxels.
struct Setting {
  double narrowest;  ///< sigma that the response and the bins allow
  double sigma;
  double sine;  ///< of the angle between the wall's normal and the way from the light's distance to the wall's edge
  double ways;  ///< see setting()
};

Setting setting(const Histograms& histograms, const DetectorResponse& response) {
  const double deviation = response_deviation(response, histograms.bin),
               narrowest = std::max(deviation, histograms.bin);
  if (4 * FilteredHistograms::margin(narrowest, histograms.bin) >= histograms.bins)
    throw InputError("the capture's " + std::to_string(histograms.bins) +
                     " bins are too few for a filter as wide as the response");
  const double half = histograms.half_side(), spacing = histograms.spacing();
  if (!(half > 0)) throw InputError("the capture's sensor points are all at one place");
  const double ways = histograms.spots.empty() ? 2 : 1;  // that change from one point of the wall to the next
  if (!(2 * ways * half > narrowest))
    throw InputError(fmt::format(
        "the capture's sensor points lie within {:.3g} m, less than light travels in one of its bins or the response's "
        "width, {:.3g} m (allowed: points in metres, delta_t and t_start as path lengths in metres)",
        2 * half, narrowest));
  // In groups and with a wide filter, for the few counts of single points.
  const double wide = std::min(4 * narrowest, histograms.bin * histograms.bins / 16);
  const double distance = distance_of_light(grouped(histograms, std::max(half / 8, spacing)), wide, response);
  Setting result{narrowest, narrowest, half / std::hypot(half, distance), ways};
  const double apart = ways * spacing * result.sine, needed = 0.25 * apart * apart - deviation * deviation;
  if (needed > narrowest * narrowest) result.sigma = std::sqrt(needed);
  if (2 * FilteredHistograms::margin(result.sigma, histograms.bin) >= histograms.bins)
    throw InputError("the capture's points are too far apart for its " + std::to_string(histograms.bins) +
                     " bins: light of a place comes to neighbours at times that differ by more");
  return result;
}

void fill_in(const SearchResult& found, const Vec3& step, BackProjection& result) {
  const auto value = [&](const SummedBlock& block, int i) { return found.albedo.of(block.sum[i], block.response[i]); };
  VoxelPlace low{}, high{};
  bool any = false;
  for (const SummedBlock& block : found.blocks) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      if (block.significance(i, found.limits.chance) < result.least_significance ||
          value(block, i) < result.least_albedo)
        continue;
      const VoxelPlace voxel = block.voxel(i);
      if (!any) low = high = voxel;
      any = true;
      for (int axis = 0; axis < 3; ++axis) {
        low[axis] = std::min(low[axis], voxel[axis]);
        high[axis] = std::max(high[axis], voxel[axis]);
      }
    }
  }
  if (!any) return;
  std::vector<double>* const axes[3] = {&result.across, &result.up, &result.depth};
  for (int axis = 0; axis < 3; ++axis) {
    low[axis] -= axis == 2 ? std::min(kMargin, low[axis]) : kMargin;
    high[axis] += kMargin;
    for (int n = low[axis]; n <= high[axis]; ++n) axes[axis]->push_back((n + 0.5) * step[axis]);
  }
  const std::size_t voxels = result.across.size() * result.up.size() * result.depth.size();
  require_memory({"the box of all that stands out in the back-projection needs", 2.0 * sizeof(float) * voxels},
                 kLessOfCapture);
  result.albedo.assign(voxels, 0);
  result.significance = result.albedo;
  for (const SummedBlock& block : found.blocks) {
    for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
      const VoxelPlace voxel = block.voxel(i);
      bool inside = true;
      for (int axis = 0; axis < 3; ++axis) inside = inside && voxel[axis] >= low[axis] && voxel[axis] <= high[axis];
      if (!inside) continue;
      const std::size_t at = result.index(voxel[2] - low[2], voxel[1] - low[1], voxel[0] - low[0]);
      result.albedo[at] = static_cast<float>(value(block, i));
      result.significance[at] = static_cast<float>(block.significance(i, found.limits.chance));
    }
  }
}

}  // namespace

BackProjection back_project(const CaptureFile& capture, const DetectorResponse& response,
                            const std::vector<std::uint8_t>& used, const BackProjectionOptions& options) {
  if (!(options.false_alarms > 0 && options.false_alarms < 1))
    throw InputError("the probability of a false alarm must be between 0 and 1");
  BackProjection result;
  result.frame = wall_frame(capture.geometry);
  const Histograms all = histograms(capture, result.frame, used);
  const Setting set = setting(all, response);
  result.filter = time_filter(set.sigma, response, all.bin);
  require_memory({"filtered histograms need", double{sizeof(FilteredHistograms::Entry)} * all.counts.size()},
                 kLessOfCapture);
  result.depth_resolution = 0.5 * result.filter.width;
  result.lateral_resolution = result.filter.width / (set.ways * set.sine);
  result.finest_resolution = time_filter(set.narrowest, response, all.bin).width / (2 * set.sine);

  SearchRegion region = reached_region(all, result.filter);
  if (!(region.high.z > 0)) throw InputError("the capture's bins end before light can have come back to the wall");
  region.step = Vec3{result.lateral_resolution, result.lateral_resolution, result.depth_resolution} * 0.5;
  result.least_significance = normal_quantile_above(options.false_alarms / region.voxels(0));
  const SearchResult found = search(all, response, set.sigma, region, result.least_significance);
  result.least_albedo = found.albedo.least;
  fill_in(found, region.step, result);
  return result;
}

}  // namespace isochron
