#include "core/render/measure_mix.h"

#include <cmath>

namespace isochron {
namespace {

/// Outside of these, relative to the path length, one technique is far better in every scene measured: gates that together
/// cover less than `from`, which standard sampling hits so rarely that it looks too quiet in a trial, and gates wider than
/// `to`.
struct Doubtful {
  double from, to;
};
constexpr Doubtful kImage{0.002, 0.1}, kInterior{0.008, 0.2};

constexpr double kShares[] = {0, 0.3, 1};
constexpr int kSamples[] = {16, 8, 4};  ///< per pixel and batch at most, of each share: for about the same work
constexpr int kMostBatches = 12, kFewestBatches = 4;
constexpr int kPixels = 4096;      ///< at most: where pixels are larger, connections from the camera look better
constexpr int kBlocks = 4;         ///< across the image
constexpr double kPaths = 300000;  ///< of standard sampling, about
/// The combination must look this much better than either technique alone, per purpose: trials are noisy, and what it
/// can lose where it is not the best is more than what it can win.
constexpr double kClearlyBetter[] = {0.75, 0.5};
/// How often to use the techniques of ellipsoidal connections: each alike, or mostly the camera's own pairs, which share
/// low-discrepancy points over the whole image; none never, as a trial may miss what is rare. The latter must look a tenth
/// better than the former.
constexpr ConnectionRates kAlike{1, 1, 1}, kMostlyCamera{0.3, 2, 0.1};
constexpr double kClearlyFaster = 0.9;
/// Per pixel and batch: a batch's points cover the whole image, so that its blocks vary together, and only more batches say
/// more about the variance.
constexpr int kRateSamples = 1, kRateBatches = 16;
/// By how much standard sampling must look better than ellipsoidal, per purpose. For gradients, noise counts most where
/// narrow gates cut, and there standard sampling, whose rare hits a trial may miss, is worse than on average. For
/// images it may look slightly worse: low-discrepancy numbers, which trials do without, gain more for its pixels (cube,
/// width 2 %: 1.7 times; box, 0.5 and 1 %: nothing).
constexpr double kClearlyHits[] = {1.1, 0.5};

/// The camera's image in fewer pixels.
Scene reduced(const Scene& scene) {
  Scene small = scene;
  const double factor = std::sqrt(kPixels / (double{1} * scene.camera.width * scene.camera.height));
  if (factor < 1) {
    // Whole pixels, so that the fields of view still agree across the width; the height may lose part of a
    // pixel.
    small.camera.width = std::max(1, static_cast<int>(factor * scene.camera.width));
    small.camera.height = std::max(1, scene.camera.height * small.camera.width / scene.camera.width);
  }
  return small;
}

/// One column: all columns of the basis with random signs.
TangentBasis combined(const TangentBasis& basis, const Stream& stream) {
  std::vector<double> sign;
  Rng rng(stream, 0, 0);
  for (int column = 0; column < basis.columns; ++column) sign.push_back(rng.uniform() < 0.5 ? -1 : 1);
  TangentBasis one;
  one.columns = 1;
  one.row_begin.push_back(0);
  for (std::size_t row = 0; row + 1 < basis.row_begin.size(); ++row) {
    double sum = 0;
    for (int e = basis.row_begin[row]; e < basis.row_begin[row + 1]; ++e)
      sum += sign[basis.entries[e].column] * basis.entries[e].coefficient;
    if (basis.moves(static_cast<int>(row))) one.entries.push_back({0, sum});
    one.row_begin.push_back(static_cast<int>(one.entries.size()));
  }
  return one;
}

/// Sums over square blocks of pixels.
GatedImage blocks_of(const GatedImage& image, int size) {
  GatedImage sums((image.width + size - 1) / size, (image.height + size - 1) / size, image.gates, image.channels);
  for (int pixel = 0; pixel < image.pixels(); ++pixel) {
    const int block = pixel / image.width / size * sums.width + pixel % image.width / size;
    for (int g = 0; g < image.gates; ++g)
      for (int c = 0; c < image.channels; ++c) sums.at(block, g, c) += image.at(pixel, g, c);
  }
  return sums;
}

/// Sum over blocks of pixels and gates of the variance between batches of images, times the work behind them.
template <class Estimate>
double variance_and_work(const Renderer& renderer, int block, int batches, int samples, Estimate&& estimate) {
  std::vector<double> mean, squares;
  for (int b = 0; b < batches; ++b) {
    const GatedImage image = blocks_of(estimate(SampleRange{b * samples, (b + 1) * samples}), block);
    mean.resize(image.data.size());
    squares.resize(image.data.size());
    for (std::size_t i = 0; i < image.data.size(); ++i) {
      const double d = image.data[i] - mean[i];
      mean[i] += d / (b + 1);
      squares[i] += d * (image.data[i] - mean[i]);
    }
  }
  double sum = 0;
  for (double s : squares) sum += s;
  return sum * renderer.work();
}

/// The better rates of connections for a term's derivative along one column, in sums over blocks.
ConnectionRates measure_rates(const Scene& small, const GateSet& gates, EstimatorOptions options,
                              const TangentBasis& column, Term term, const Stream& stream, int block) {
  const auto cost = [&](const ConnectionRates& rates) {
    options.mix = SamplingMix{1, 1, rates, rates};
    const Renderer renderer(small, gates, options, &column);
    if (!renderer.has(term)) return 0.0;
    return variance_and_work(renderer, block, kRateBatches, kRateSamples,
                             [&](SampleRange range) { return renderer.derive(term, stream, range)[0]; });
  };
  const double alike = cost(kAlike);
  return alike > 0 && cost(kMostlyCamera) < kClearlyFaster * alike ? kMostlyCamera : kAlike;
}

}  // namespace

SamplingMix measure_mix(const Scene& scene, const GateSet& gates, const EstimatorOptions& options,
                        const TangentBasis* basis, const Stream& stream, Purpose purpose) {
  const double width = gates.relative_width(), coverage = gates.relative_coverage();
  if (options.sampling == Sampling::standard || gates.shape().is_steady()) return {0, 0};
  if (options.sampling == Sampling::ellipsoidal) return {1, 1};
  const Scene small = reduced(scene);
  const double samples = kPaths / (small.camera.width * small.camera.height);
  const int batches = std::clamp(static_cast<int>(samples / kSamples[0]), kFewestBatches, kMostBatches);
  const auto choose = [&](const Doubtful& widths, int block, const TangentBasis* moving, auto&& estimate) -> double {
    if (coverage < widths.from) return 1;
    if (width > widths.to) return 0;
    double cost[3];
    for (int i = 0; i < 3; ++i) {
      EstimatorOptions trial = options;
      trial.mix = SamplingMix{kShares[i], kShares[i]};
      // What low-discrepancy numbers gain grows with the samples, and trials have others than what they decide about.
      trial.numbers = Numbers::independent;
      const Renderer renderer(small, gates, trial, moving);
      cost[i] =
          variance_and_work(renderer, block, batches,
                            std::clamp(static_cast<int>(samples / batches * kSamples[i] / kSamples[0]), 1, kSamples[i]),
                            [&](SampleRange range) { return estimate(renderer, range); });
      // Nothing seen says nothing: a technique that never hit the gates is no good one.
      if (!(cost[i] > 0)) cost[i] = INFINITY;
    }
    const bool gradients = purpose == Purpose::gradients;
    const int alone = cost[0] <= kClearlyHits[gradients] * cost[2] ? 0 : 2;
    return kShares[cost[1] < kClearlyBetter[gradients] * cost[alone] ? 1 : alone];
  };
  SamplingMix best;
  best.image =
      choose(kImage, 1, nullptr, [&](const Renderer& r, SampleRange range) { return r.render(stream, range); });
  if (!basis || basis->columns == 0) return best;
  const TangentBasis one = combined(*basis, stream);
  const int block = purpose == Purpose::images ? 1 : std::max(1, small.camera.width / kBlocks);
  best.interior = choose(kInterior, block, &one, [&](const Renderer& r, SampleRange range) {
    return r.derive(Term::interior, stream, range)[0];
  });
  // Paths of more bounces are found by walks alone, and what rare ones carry a trial cannot tell.
  if (options.max_bounces != 1) return best;
  if (best.interior == 1)
    best.interior_rates = measure_rates(small, gates, options, one, Term::interior, stream, block);
  best.path_length_rates = measure_rates(small, gates, options, one, Term::path_length, stream, block);
  return best;
}

}  // namespace isochron
