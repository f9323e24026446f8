// Low-discrepancy samples: what they gain, and that ranges stay independent.
#include <gtest/gtest.h>

#include <algorithm>

#include "pixel_statistics.h"
#include "scene_building.h"
#include "support.h"

namespace isochron::testing {
namespace {

/// The inside of a diffuse box with a lamp below its ceiling.
Scene lit_box() {
  Scene scene;
  scene.camera = {{0, 1, 1.9}, {0, 0.6, 0}, {0, 1, 0}, 60, 24, 24};
  add_shape(scene, "room", box({-1, 0, -2}, {1, 2, 2}, true), diffuse(Rgb(0.6)));
  add_shape(scene, "lamp", quad({-0.3, 1.95, -0.3}, {0.3, 1.95, -0.3}, {0.3, 1.95, 0.3}, {-0.3, 1.95, 0.3}),
            diffuse(Rgb(0.0)), Rgb(10.0));
  return scene;
}

const GateSet kWideGates(GateShape::gaussian(0.5), {3.5, 5});

// Direct light, 16 samples: the mean variance of pixels over 32 repeats, known to 2 % or so; it falls 3.3 times.
TEST(LowDiscrepancy, VarianceOfASmoothImageFalls) {
  const Scene scene = lit_box();
  const auto variance = [&](Numbers numbers) {
    const Renderer renderer(scene, kWideGates, {.max_bounces = 1, .sampling = Sampling::standard, .numbers = numbers});
    PixelBatches batches;
    for (std::uint32_t b = 0; b < 32; ++b) batches.add(renderer.render({1, b, 0}, {0, 16}));
    return batches.mean_variance();
  };
  EXPECT_GT(variance(Numbers::independent), 2 * variance(Numbers::low_discrepancy));
}

// Deviations of pixels from their mean in one range tell nothing about those in the next: over 576 pixels and 64
// repeats their correlation is normal with deviation (576 * 64)^-1/2 where all are independent. Neighbouring ranges,
// streams and pixels at |z| < 4.5: false alarm 7e-6 each, four tests.
TEST(LowDiscrepancy, RangesStreamsAndPixelsAreIndependent) {
  constexpr int kRepeats = 64;
  const Scene scene = lit_box();
  const Renderer renderer(scene, kWideGates, {.max_bounces = 1, .sampling = Sampling::standard});
  const auto deviations = [&](std::uint32_t pass, SampleRange range) {
    std::vector<GatedImage> images;
    for (std::uint32_t i = 0; i < kRepeats; ++i) images.push_back(renderer.render({1, i, pass}, range));
    std::vector<std::vector<double>> z(kRepeats);
    for (std::size_t pixel = 0; pixel < images[0].data.size(); pixel += images[0].gates) {
      Batches batches;
      for (const GatedImage& image : images) batches.add(image.data[pixel]);
      const Estimate e = batches.estimate();
      for (int i = 0; i < kRepeats; ++i)
        z[i].push_back(e.standard_error > 0
                           ? (images[i].data[pixel] - e.mean) / (e.standard_error * std::sqrt(double{kRepeats}))
                           : 0);
    }
    return z;
  };
  // Of a[i][pixel] and b[i + later][pixel + further].
  const auto score = [](const auto& a, const auto& b, std::size_t later, std::size_t further) {
    double sum = 0, count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      for (std::size_t pixel = 0; pixel < a[i].size(); ++pixel)
        sum += a[i][pixel] * b[(i + later) % a.size()][(pixel + further) % a[i].size()], count += a[i][pixel] != 0;
    return sum / std::sqrt(count);
  };
  const auto first = deviations(0, {0, 8});
  // Deviations from a mean of their own add up to zero: of two neighbours the expected product is -1 / kRepeats.
  const double lit = static_cast<double>(std::ranges::count_if(first[0], [](double z) { return z != 0; }));
  const double own = -lit / std::sqrt(lit * kRepeats);
  EXPECT_LT(std::abs(score(first, deviations(0, {8, 16}), 0, 0)), 4.5);
  EXPECT_LT(std::abs(score(first, deviations(1, {0, 8}), 0, 0)), 4.5);
  EXPECT_LT(std::abs(score(first, first, 1, 0) - own), 4.5);
  EXPECT_LT(std::abs(score(first, first, 0, 1)), 4.5);
  EXPECT_GT(score(first, deviations(0, {0, 16}), 0, 0), 100);  // the same points: not independent
}

}  // namespace
}  // namespace isochron::testing
