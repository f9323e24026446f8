// What a Renderer works with: its passes, and the background, which no path finds.
#pragma once
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "core/render/passes.h"
#include "core/render/renderer.h"

namespace isochron {

inline void add_to(std::vector<double>& sum, const std::vector<double>& other) {
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += other[i];
}

struct Renderer::Impl : Passes {
  using Passes::Passes;

  GatedImage blank() const {
    return GatedImage(scene.camera.width, scene.camera.height, gates.size(), scene.scene.grey ? 1 : 3);
  }

  /// Whether there are enough of them for partitions that have their pixels for themselves.
  bool has_many_pixels() const { return Partition::blocks(scene.pixels()) >= kFewestPartitions; }

  /// run(partition) of every partition, whose samples add only to pixels of its own, and so need no sums.
  template <class Run>
  void run_in_pixels(PassKind kind, std::span<GatedImage> images, Run&& run) const {
    const int count = Partition{0, kMostPartitions}.pixel_parts(scene.pixels());
    SharedPartitions shared(count, partition_costs(kind, count));
    shared.run([&](int partition) { run(Partition{partition, count}); });
    const auto exchange = [&](int partition, auto&& values_of_pixel) {
      for_each_pixel({partition, count}, scene.pixels(), [&](int pixel) {
        for (GatedImage& image : images) {
          const std::size_t values = image.data.size() / static_cast<std::size_t>(image.pixels());
          values_of_pixel(&image.data[pixel * values], values);
        }
      });
    };
    all_gather_parts(
        shared.parts,
        [&](Packer& packer, int partition) {
          packer.put(shared.costs[partition]);
          exchange(partition, [&](const double* values, std::size_t n) { packer.put(values, n); });
        },
        [&](Unpacker& unpacker, int partition) {
          unpacker.get(shared.costs[partition]);
          exchange(partition, [&](double* values, std::size_t n) { unpacker.get(values, n); });
        });
    shared.keep_costs();
  }

  /// Adds to the images what run(films, partition) adds to a film for each; `in_pixels`: to pixels of the partition only.
  template <class Run>
  void add_films(PassKind kind, SampleRange range, std::span<GatedImage> images, bool in_pixels, Run&& run) const {
    if (in_pixels && has_many_pixels()) {
      const std::vector<Film> films(images.begin(), images.end());
      run_in_pixels(kind, images, [&](Partition partition) { run(films, partition); });
      return;
    }
    const std::size_t size = images[0].data.size();
    sum_of_films(kind, range, static_cast<int>(images.size()), run)
        .for_each(0, size * images.size(),
                  [&](std::size_t i, double value) { images[i / size].data[i % size] += value; });
  }

  void run_images(const Pass& pass, const std::vector<Film>& films, Partition partition) const {
    PrimalSink sink(gates, films[0]);
    Passes::run_images(pass, partition, sink);
  }
  void run_term(Term term, const Pass& pass, const std::vector<Film>& films, Partition partition) const {
    TangentSink sink(gates, scene.layout, *basis, films);
    Passes::run_term(term, pass, partition, every_gate, sink);
  }
  using Passes::run_images, Passes::run_term;

  /// Of a gradient. Partitions take turns at blocks of pixels.
  static int part_of(int pixel) { return pixel / kPixelsPerBlock % kGradientParts; }

  /// The background of a pixel, and its degree of freedom.
  std::pair<double, int> background_of(int pixel) const {
    const Detector& detector = scene.scene.detector;
    const int i = detector.background_of(scene.scene.capture, pixel);
    return {detector.background[i], scene.layout.background(i)};
  }
  /// f(pixel, background of the pixel, its degree of freedom), but for pixels that are left out.
  template <class F>
  void for_each_background(F&& f) const {
    for (int pixel = 0; pixel < scene.pixels(); ++pixel) {
      if (scene.leaves_out(pixel)) continue;
      const auto [value, dof] = background_of(pixel);
      f(pixel, value, dof);
    }
  }
  void add_background(GatedImage& image) const {
    const std::size_t values = image.data.size() / static_cast<std::size_t>(image.pixels());
    for_each_background([&](int pixel, double background, int) {
      for (std::size_t i = 0; background != 0 && i < values; ++i) image.data[pixel * values + i] += background;
    });
  }
  /// Of the background, which counts in the interior term.
  void add_background_derivative(std::vector<GatedImage>& images) const {
    for_each_background([&](int pixel, double, int dof) {
      for (int e = basis->row_begin[dof]; e < basis->row_begin[dof + 1]; ++e) {
        GatedImage& image = images[basis->entries[e].column];
        const std::size_t values = image.data.size() / static_cast<std::size_t>(image.pixels());
        for (std::size_t i = 0; i < values; ++i) image.data[pixel * values + i] += basis->entries[e].coefficient;
      }
    });
  }
  void add_background_gradient(const GatedImage& adjoint, std::vector<double>& dof_gradient,
                               std::vector<std::vector<double>>* parts) const {
    const auto values = static_cast<std::ptrdiff_t>(adjoint.data.size()) / adjoint.pixels();
    for_each_background([&](int pixel, double, int dof) {
      if (!basis->differentiates(dof)) return;
      const auto begin = adjoint.data.begin() + pixel * values;
      const double sum = std::accumulate(begin, begin + values, 0.0);
      dof_gradient[dof] += sum;
      for (int e = basis->row_begin[dof]; parts && e < basis->row_begin[dof + 1]; ++e)
        (*parts)[part_of(pixel)][basis->entries[e].column] += basis->entries[e].coefficient * sum;
    });
  }
};

}  // namespace isochron
