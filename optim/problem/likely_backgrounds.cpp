#include "optim/problem/likely_backgrounds.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "optim/problem/readings.h"

namespace isochron {
namespace {

/// One reading: the light of both halves, and the count.
struct LitCount {
  double light[2], count;
};

/// Weights and weighted sums of both halves.
struct HalfSums {
  double weights[2] = {}, sums[2] = {};
};

/// That a thread takes at a time.
constexpr std::size_t kTogether = 1 << 14;

/// Fisher's scoring: each step solves for both halves with the weights of the step before. The same for any number of threads.
void find_likely(const std::vector<LitCount>& readings, double scale, double (&background)[2]) {
  constexpr int kMostSteps = 100;
  constexpr double kNearlyThere = 1e-9;
  std::vector<HalfSums> parts((readings.size() + kTogether - 1) / kTogether);
  for (int i = 0; i < kMostSteps; ++i) {
    parallel_ranges(parts.size(), 1, [&](std::size_t part, std::size_t) {
      HalfSums own;
      const std::size_t end = std::min(readings.size(), (part + 1) * kTogether);
      for (std::size_t k = part * kTogether; k < end; ++k)
        for (const int half : {0, 1}) {
          const LitCount& r = readings[k];
          const int other = 1 - half;
          const double w = 1 / std::max(r.light[other] + background[other], scale);
          own.weights[half] += w;
          own.sums[half] += w * (r.count - r.light[half]);
        }
      parts[part] = own;
    });
    double change = 0;
    for (const int half : {0, 1}) {
      double weights = 0, sum = 0;
      for (const HalfSums& part : parts) {
        weights += part.weights[half];
        sum += part.sums[half];
      }
      const double next = weights > 0 ? std::max(0.0, sum / weights) : background[half];
      change = std::max(change, std::abs(next - background[half]) - kNearlyThere * next);
      background[half] = next;
    }
    if (change <= 0) return;
  }
}

}  // namespace

void take_likely_backgrounds(CountModel& model, SplitImage& image, const GatedImage& counts, const ReadingLoss& loss) {
  std::vector<std::vector<int>> pixels(model.background_free.size());
  for (int pixel = 0; pixel < std::ssize(model.background_unknown); ++pixel) {
    const int b = model.background_unknown[pixel];
    if (b >= 0 && model.background_free[b] && loss.readings.uses_pixel(pixel)) pixels[b].push_back(pixel);
  }
  const double shares[] = {1 - image.first, -image.first};  // of the difference, in either half
  std::vector<LitCount> lit;
  for (std::size_t b = 0; b < pixels.size(); ++b) {
    if (pixels[b].empty()) continue;
    const auto for_own = [&](auto&& f) {
      for (const int pixel : pixels[b])
        for_each_reading(counts, loss.readings, pixel, [&](std::size_t i) { f(model.background[pixel], i); });
    };
    lit.clear();
    for_own([&](double background, std::size_t i) {
      const double d = image.halved() ? image.difference.data[i] : 0, light = image.image.data[i] - background;
      lit.push_back({{std::max(0.0, light + shares[0] * d), std::max(0.0, light + shares[1] * d)}, counts.data[i]});
    });
    const double before = model.background[pixels[b][0]];
    double likely[] = {before, before};
    find_likely(lit, loss.scale, likely);
    const double mean = image.first * likely[0] + (1 - image.first) * likely[1];
    for_own([&](double background, std::size_t i) {
      image.image.data[i] += mean - background;
      if (image.halved()) image.difference.data[i] += likely[0] - likely[1];
    });
    for (const int pixel : pixels[b]) model.background[pixel] = mean;
    model.background_free[b] = mean > 0;
  }
}

}  // namespace isochron
