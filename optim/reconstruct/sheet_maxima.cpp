#include "optim/reconstruct/sheet_maxima.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"

namespace isochron {
namespace {

constexpr int kBlur = 3;   // voxels: one and a half lateral resolutions
constexpr int kApart = 4;  // voxels: two depth resolutions

/// The largest albedo at the same depth within kBlur voxels.
std::vector<float> greatest_nearby(const BackProjection& volume) {
  const int width = static_cast<int>(volume.across.size()), height = static_cast<int>(volume.up.size());
  std::vector<float> result(volume.albedo.size());
  parallel(static_cast<int>(volume.depth.size()), [&](int d) {
    std::vector<float> rows(static_cast<std::size_t>(width) * height);
    const float* slice = &volume.albedo[volume.index(d, 0, 0)];
    for (int i = 0; i < width * height; ++i) {
      const int a = i % width, first = i - std::min(a, kBlur), last = i + std::min(width - 1 - a, kBlur);
      rows[i] = *std::max_element(slice + first, slice + last + 1);
    }
    for (int i = 0; i < width * height; ++i) {
      const int u = i / width;
      float greatest = 0;
      for (int v = std::max(0, u - kBlur); v <= std::min(height - 1, u + kBlur); ++v)
        greatest = std::max(greatest, rows[v * width + i % width]);
      result[volume.index(d, 0, 0) + i] = greatest;
    }
  });
  return result;
}

}  // namespace

std::vector<std::vector<SheetMaximum>> sheet_maxima(const BackProjection& volume) {
  const std::vector<float> nearby = greatest_nearby(volume);
  const std::size_t lines = volume.across.size() * volume.up.size();
  const int depths = static_cast<int>(volume.depth.size());
  std::vector<std::vector<SheetMaximum>> result(lines);
  for (std::size_t line = 0; line < lines; ++line) {
    const auto at = [&](int d) { return d * lines + line; };
    for (int d = 1; d + 1 < depths; ++d) {
      const double before = volume.albedo[at(d - 1)], here = volume.albedo[at(d)], behind = volume.albedo[at(d + 1)];
      const double border = std::max<double>(volume.least_albedo, 0.5 * nearby[at(d)]);
      if (!(here >= before && here > behind) || !volume.is_surface(at(d))) continue;
      if (here < border) continue;
      std::vector<SheetMaximum>& found = result[line];
      if (!found.empty() && d - found.back().voxel < kApart) continue;
      const double slope = 0.5 * (behind - before), curvature = before - 2 * here + behind;
      const double offset = -slope / curvature;  // within half a voxel, since `here` is the largest of the three
      found.push_back(
          {volume.depth[d] + offset * (volume.depth[d] - volume.depth[d - 1]), here + 0.5 * slope * offset, border, d});
    }
  }
  return result;
}

}  // namespace isochron
