#include "optim/problem/likely_backgrounds.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "optim/problem/readings.h"

namespace isochron {
namespace {

/// One reading of a half: its light, and the count.
struct LitCount {
  double light, count;
};

/// The root b >= 0 of sum of (N - l - b) / V(l + b), which falls; 0 where it is nowhere positive. Above the scale it is convex, so that
/// Newton's steps from the left stay there; the scale's kink may send one too far, which a bisection mends.
double likely_background(const std::vector<LitCount>& readings, double scale) {
  constexpr int kMostSteps = 100;
  constexpr double kNearlyThere = 1e-12;
  double b = 0, low = 0, high = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostSteps; ++i) {
    double value = 0, slope = 0;
    for (const LitCount& r : readings) {
      const double m = r.light + b, v = std::max(m, scale);
      value += (r.count - m) / v;
      slope -= m > scale ? r.count / (v * v) : 1 / v;
    }
    if (i == 0 && !(value > 0)) return 0;
    (value > 0 ? low : high) = b;
    double next = b - value / slope;
    if (!(next >= low && next <= high)) next = std::isfinite(high) ? (low + high) / 2 : 2 * b + scale;
    const double step = std::abs(next - b);
    b = next;
    if (step <= kNearlyThere * b) break;
  }
  return b;
}

}  // namespace

void take_likely_backgrounds(CountModel& model, SplitImage& image, const GatedImage& counts, const ReadingLoss& loss) {
  std::vector<std::vector<int>> pixels(model.background_free.size());
  for (int pixel = 0; pixel < std::ssize(model.background_unknown); ++pixel) {
    const int b = model.background_unknown[pixel];
    if (b >= 0 && model.background_free[b]) pixels[b].push_back(pixel);
  }
  const double shares[] = {1 - image.first, -image.first};  // of the difference, in either half
  std::vector<LitCount> lit;
  for (const std::vector<int>& own : pixels) {
    const auto for_own = [&](auto&& f) {
      for (const int pixel : own) for_each_reading(counts, loss.readings, pixel, [&](std::size_t i) { f(pixel, i); });
    };
    double most_likely[2] = {};
    for (int half = 0; half < (image.halved() ? 2 : 1); ++half) {
      lit.clear();
      for_own([&](int pixel, std::size_t i) {
        const double d = image.halved() ? shares[half] * image.difference.data[i] : 0;
        lit.push_back({std::max(0.0, image.image.data[i] + d - model.background[pixel]), counts.data[i]});
      });
      most_likely[half] = likely_background(lit, loss.scale);
    }
    if (!image.halved()) most_likely[1] = most_likely[0];
    const double mean = image.first * most_likely[0] + (1 - image.first) * most_likely[1];
    for_own([&](int pixel, std::size_t i) {
      image.image.data[i] += mean - model.background[pixel];
      if (image.halved()) image.difference.data[i] += most_likely[0] - most_likely[1];
    });
    for (const int pixel : own) model.background[pixel] = mean;
  }
}

}  // namespace isochron
