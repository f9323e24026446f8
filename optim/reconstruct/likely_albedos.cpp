#include "optim/reconstruct/likely_albedos.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/parallel.h"
#include "core/base/progress.h"
#include "core/base/self_weighted_mean.h"
#include "optim/problem/memory.h"
#include "optim/reconstruct/arrivals.h"

namespace isochron {
namespace {

constexpr int kFiner = 2;    // voxels per side of one of the back-projection
constexpr int kNear = 2;     // of the back-projection's voxels: a resolution
constexpr int kSteps = 256;  // by the silhouettes of seven shapes (optim/README.md)
/// Of a step. Fewer make it jump.
constexpr std::size_t kLeastRows = 64;
constexpr double kLeastPhotons = 1e5;
/// Of the mean albedo weighted by itself, and steps after which darker voxels are left out. Surfaces end at 0.05 of it at least.
constexpr double kLeastAlbedo = 0.01;
constexpr int kDropSteps = 8;
/// Rounds in which a background follows what light leaves of a histogram.
constexpr int kBackgroundRounds = 2;
/// Of a histogram's mean, so that no count is impossible.
constexpr double kLeastBackground = 1e-3;

struct LitVoxels : VoxelBlock {
  Values albedo;
  std::array<std::size_t, kVoxels> index;  ///< in LikelyAlbedos::albedo
};

/// Shares of light that is counted so many bins later, from `first` on.
struct BinResponse {
  int first = 0;
  std::vector<float> shares{1};

  BinResponse(const DetectorResponse& response, double bin) {
    if (!response) return;
    first = static_cast<int>(std::floor(response->lower() / bin + 0.5));
    const int last = static_cast<int>(std::ceil(response->upper() / bin - 0.5));
    shares.clear();
    for (int i = first; i <= last; ++i)
      shares.push_back(
          static_cast<float>(response->cumulated((i + 0.5) * bin).below - response->cumulated((i - 0.5) * bin).below));
  }
};

/// Half as wide as those of an axis.
std::vector<double> finer(const std::vector<double>& middles) {
  const double side = middles[1] - middles[0];
  std::vector<double> result;
  for (const double middle : middles)
    for (int k = 0; k < kFiner; ++k) result.push_back(middle + side * ((k + 0.5) / kFiner - 0.5));
  return result;
}

/// Of the back-projection's voxels, those no further than kNear from a surface's.
std::vector<char> near_surfaces(const BackProjection& volume) {
  const int size[3] = {static_cast<int>(volume.across.size()), static_cast<int>(volume.up.size()),
                       static_cast<int>(volume.depth.size())};
  std::vector<char> result(volume.albedo.size());
  const auto range = [&](int at, int axis) {
    return std::pair{std::max(0, at - kNear), std::min(size[axis] - 1, at + kNear)};
  };
  for (int d = 0; d < size[2]; ++d)
    for (int u = 0; u < size[1]; ++u)
      for (int a = 0; a < size[0]; ++a) {
        if (!volume.is_surface(volume.index(d, u, a))) continue;
        const auto [first_d, last_d] = range(d, 2);
        const auto [first_u, last_u] = range(u, 1);
        const auto [first_a, last_a] = range(a, 0);
        for (int e = first_d; e <= last_d; ++e)
          for (int v = first_u; v <= last_u; ++v)
            std::fill_n(result.begin() + static_cast<std::ptrdiff_t>(volume.index(e, v, first_a)), last_a - first_a + 1,
                        1);
      }
  return result;
}

class Maximisation {
 public:
  Maximisation(const LikelyAlbedos& space, const std::vector<std::size_t>& lit, const Histograms& histograms,
               const DetectorResponse& response)
      : space_(space), histograms_(histograms), response_(response, histograms.bin) {
    for (const std::size_t i : lit) add(i, 1);
    pad();
    for (std::size_t row = 0; row < histograms.rows.size(); ++row) {
      double sum = 0;
      for (int bin = 0; bin < bins(); ++bin) sum += std::max(0.0f, histograms.of(row)[bin]);
      photons_.push_back(sum);
    }
    for (const double photons : photons_) background_.push_back(photons / bins());
  }

  void run() {
    const std::size_t rows = histograms_.rows.size();
    const double photons = std::accumulate(photons_.begin(), photons_.end(), 0.0);
    const auto enough = static_cast<std::size_t>(
        std::ceil(static_cast<double>(rows) * std::min(1.0, kLeastPhotons / std::max(photons, 1.0))));
    const std::size_t each = std::min(rows, std::max(kLeastRows, enough));
    // Rows a golden section of all apart, so that any some that follow each other are spread over the wall.
    std::size_t stride = static_cast<std::size_t>(0.618 * static_cast<double>(rows)) | 1;
    while (std::gcd(stride, rows) != 1) stride += 2;
    std::size_t next = 0;
    scale_to(photons / static_cast<double>(rows));
    ProgressStage stage("likely albedos", kSteps);
    for (int step = 0; step < kSteps; ++step) {
      std::vector<std::size_t> some;
      for (std::size_t i = 0; i < each; ++i, next = (next + stride) % rows) some.push_back(next);
      make_step(some);
      stage.advance();
      if ((step + 1) % kDropSteps == 0) drop_dark();
    }
  }

  void write(std::vector<float>& albedo) const {
    for (const LitVoxels& block : blocks_)
      for (int i = 0; i < VoxelBlock::kVoxels; ++i)
        if (block.albedo[i] > 0) albedo[block.index[i]] = block.albedo[i];
  }

 private:
  int bins() const { return histograms_.bins; }

  void add(std::size_t index, float albedo) {
    if (count_ % VoxelBlock::kVoxels == 0) blocks_.emplace_back();
    LitVoxels& block = blocks_.back();
    const std::size_t i = count_++ % VoxelBlock::kVoxels, across = space_.across.size(), up = space_.up.size();
    block.across[i] = static_cast<float>(space_.across[index % across]);
    block.up[i] = static_cast<float>(space_.up[index / across % up]);
    block.depth[i] = static_cast<float>(space_.depth[index / across / up]);
    block.albedo[i] = albedo;
    block.index[i] = index;
  }

  /// The last block is made full of voxels without albedo.
  void pad() {
    while (count_ % VoxelBlock::kVoxels != 0) add(blocks_.back().index[0], 0);
  }

  void arrive(Arrivals& arrivals, const VoxelBlock& block, std::size_t row) const {
    const double first = -histograms_.rows[row].start / histograms_.bin;
    arrivals.set(block, histograms_, row, static_cast<float>(first), static_cast<float>(bins() - 1));
  }

  /// All albedos the same, as much light in a histogram as that many photons.
  void scale_to(double photons) {
    Arrivals arrivals;
    double weights = 0;
    const std::size_t stride = std::max<std::size_t>(1, histograms_.rows.size() / kLeastRows);
    int rows = 0;
    for (std::size_t row = 0; row < histograms_.rows.size(); row += stride, ++rows)
      for (const LitVoxels& block : blocks_) {
        arrive(arrivals, block, row);
        for (int i = 0; i < VoxelBlock::kVoxels; ++i) weights += block.albedo[i] * arrivals.weight[i];
      }
    if (!(weights > 0)) return;
    const auto start = static_cast<float>(photons * rows / weights);
    for (LitVoxels& block : blocks_)
      for (float& albedo : block.albedo) albedo *= start;
  }

  void make_step(const std::vector<std::size_t>& rows) {
    const auto stride = static_cast<std::size_t>(bins()) + 1;
    std::vector<float> excess(rows.size() * stride);
    parallel(static_cast<int>(rows.size()), [&](int i) { expect(rows[i], &excess[i * stride]); });
    parallel(static_cast<int>(blocks_.size()), [&](int b) {
      LitVoxels& block = blocks_[b];
      Arrivals arrivals;
      Arrivals::Values sum{}, weights{};
      for (std::size_t k = 0; k < rows.size(); ++k) {
        arrive(arrivals, block, rows[k]);
        const float* of = &excess[k * stride];
        for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
          const float here = of[arrivals.entry[i]], next = of[arrivals.entry[i] + 1];
          sum[i] += arrivals.weight[i] * (here + arrivals.along[i] * (next - here));
          weights[i] += arrivals.weight[i];
        }
      }
      for (int i = 0; i < VoxelBlock::kVoxels; ++i)
        if (weights[i] > 0) block.albedo[i] *= sum[i] / weights[i];
    });
  }

  /// For light that arrives in each bin: counts over what is expected, in the mean over the bins where it is counted.
  void expect(std::size_t row, float* excess) {
    std::vector<float> light(bins() + 1), expected(bins());
    Arrivals arrivals;
    for (const LitVoxels& block : blocks_) {
      arrive(arrivals, block, row);
      for (int i = 0; i < VoxelBlock::kVoxels; ++i) {
        const float sent = block.albedo[i] * arrivals.weight[i], late = sent * arrivals.along[i];
        light[arrivals.entry[i]] += sent - late;
        light[arrivals.entry[i] + 1] += late;
      }
    }
    const int shares = static_cast<int>(response_.shares.size());
    const auto each_share = [&](int bin, auto&& f) {
      const int from = std::max(0, -(bin + response_.first)), to = std::min(shares, bins() - bin - response_.first);
      for (int k = from; k < to; ++k) f(bin + response_.first + k, response_.shares[k]);
    };
    for (int bin = 0; bin < bins(); ++bin)
      if (light[bin] > 0) each_share(bin, [&](int counted, float share) { expected[counted] += share * light[bin]; });
    if (photons_[row] == 0) return;
    const float* counts = histograms_.of(row);
    double& background = background_[row];
    const auto ratio = [&](int bin) { return std::max(0.0, 1.0 * counts[bin]) / (expected[bin] + background); };
    for (int round = 0; round < kBackgroundRounds; ++round) {
      double mean = 0;
      for (int bin = 0; bin < bins(); ++bin) mean += ratio(bin) / bins();
      background = std::max(background * mean, kLeastBackground * photons_[row] / bins());
    }
    std::vector<float> ratios(bins());
    for (int bin = 0; bin < bins(); ++bin) ratios[bin] = static_cast<float>(ratio(bin));
    for (int bin = 0; bin < bins(); ++bin)
      each_share(bin, [&](int counted, float share) { excess[bin] += share * ratios[counted]; });
  }

  void drop_dark() {
    SelfWeightedMean found;
    for (const LitVoxels& block : blocks_)
      for (const float albedo : block.albedo) found.add(albedo);
    const double least = kLeastAlbedo * found.mean();
    std::vector<std::pair<std::size_t, float>> left;
    for (const LitVoxels& block : blocks_)
      for (int i = 0; i < VoxelBlock::kVoxels; ++i)
        if (block.albedo[i] > least) left.emplace_back(block.index[i], block.albedo[i]);
    if (left.empty()) return;
    blocks_.clear();
    count_ = 0;
    for (const auto& [index, albedo] : left) add(index, albedo);
    pad();
  }

  const LikelyAlbedos& space_;
  const Histograms& histograms_;
  const BinResponse response_;
  std::vector<LitVoxels> blocks_;
  std::size_t count_ = 0;
  std::vector<double> photons_, background_;  ///< of each histogram; of each, per bin
};

}  // namespace

LikelyAlbedos likely_albedos(const BackProjection& volume, const Histograms& histograms,
                             const DetectorResponse& response) {
  LikelyAlbedos result;
  result.frame = volume.frame;
  // Under one spot the ways to a place are the same for all histograms.
  result.resolution = (histograms.spots.size() == 1 ? 2 : 1) * volume.finest_resolution;
  if (volume.across.size() < 2 || volume.up.size() < 2 || volume.depth.size() < 2) return result;
  result.across = finer(volume.across);
  result.up = finer(volume.up);
  result.depth = finer(volume.depth);
  const std::size_t voxels = result.across.size() * result.up.size() * result.depth.size();
  // And their blurred copy (start_surface.cpp).
  require_memory({"the box of all that stands out in the back-projection needs", 2.0 * sizeof(float) * voxels},
                 kLessOfCapture);
  result.albedo.assign(voxels, 0);
  const std::vector<char> near = near_surfaces(volume);
  std::vector<std::size_t> lit;
  for (std::size_t d = 0; d < result.depth.size(); ++d)
    for (std::size_t u = 0; u < result.up.size(); ++u)
      for (std::size_t a = 0; a < result.across.size(); ++a)
        if (near[volume.index(d / kFiner, u / kFiner, a / kFiner)]) lit.push_back(result.index(d, u, a));
  if (lit.empty()) return result;
  Maximisation maximisation(result, lit, histograms, response);
  maximisation.run();
  maximisation.write(result.albedo);
  return result;
}

}  // namespace isochron
