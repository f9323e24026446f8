// Variance x CPU seconds of images and derivatives by several options, measured in turns.
#pragma once
#include <cstdio>
#include <span>
#include <vector>

#include "core/base/cpu_time.h"
#include "core/render/renderer.h"
#include "tests/render/pixel_statistics.h"

namespace isochron::benchmarks {

/// By each of `options`: variance x CPU seconds over the mean square, summed over pixels and gates, of image(renderer, stream), from
/// `seeds` independent ones. Below zero where the square is less than its noise.
template <class Image>
std::vector<double> relative_costs(const Scene& scene, const GateSet& gates, std::span<const EstimatorOptions> options,
                                   const TangentBasis& basis, int seeds, Image&& image) {
  std::vector<testing::PixelBatches> images(options.size());
  std::vector<double> seconds(options.size());
  for (int seed = 0; seed < seeds; ++seed)
    for (std::size_t i = 0; i < options.size(); ++i) {
      const Renderer renderer(scene, gates, options[i], &basis);
      const Stream stream{static_cast<std::uint64_t>(81 + seed), 0, 1};
      const double start = cpu_seconds();
      const GatedImage found = image(renderer, stream);
      seconds[i] += (cpu_seconds() - start) / seeds;
      images[i].add(found);
    }
  std::vector<double> costs;
  for (std::size_t i = 0; i < options.size(); ++i) {
    double square = 0, variance = 0;
    for (std::size_t k = 0; k < images[i].mean().data.size(); ++k) {
      variance += images[i].variance(k);
      square += images[i].mean().data[k] * images[i].mean().data[k] - images[i].variance(k);
    }
    costs.push_back(seeds * variance * seconds[i] / square);
  }
  return costs;
}

/// Ends a row of a table by them.
inline void write_costs(const std::vector<double>& costs, std::FILE* out) {
  for (const double cost : costs) std::fprintf(out, ",%.3g", cost);
  std::fprintf(out, "\n");
  std::fflush(out);
}

}  // namespace isochron::benchmarks
