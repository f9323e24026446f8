// Sinks that keep account of where light and its derivatives come from: by number of bounces, gate and shape.
// Exact: one pass sorts the paths, so that what is left out by fewer bounces is known without the noise of a
// difference.
#pragma once
#include <span>
#include <vector>

#include "core/films/breakdown.h"
#include "core/films/sinks.h"

namespace isochron {

/// Tells a breakdown which complete path (last vertex on an emitter) the next contributions belong to; other
/// sinks do not ask.
template <class Sink>
void note_path(Sink& sink, const Path& path) {
  if constexpr (requires { sink.note_path(path); }) sink.note_path(path);
}
/// The same for a boundary segment at a triangle's edge, on paths of so many bounces.
template <class Sink>
void note_boundary(Sink& sink, int bounces, int triangle) {
  if constexpr (requires { sink.note_boundary(bounces, triangle); }) sink.note_boundary(bounces, triangle);
}

/// Bounces and shapes of the path at hand.
class PathOrigin {
 public:
  explicit PathOrigin(const PreparedScene& scene) : scene_(scene) {}
  void note_path(const Path& path) {
    bounces = path.size() - 2;
    shapes.clear();
    for (int i = 1; i < path.size(); ++i) add_shape(path.vertex[i].triangle);
  }
  void note_boundary(int n, int triangle) {
    bounces = n;
    shapes.clear();
    add_shape(triangle);
  }
  int bounces = 0;
  std::vector<int> shapes;  ///< each once

 private:
  void add_shape(int triangle) {
    const int shape = scene_.shape_index(triangle);
    if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) shapes.push_back(shape);
  }
  const PreparedScene& scene_;
};

class ImageBreakdownSink {
 public:
  static constexpr bool kDifferential = false;
  ImageBreakdownSink(const PreparedScene& scene, const GateSet& gates, ImageBreakdown& breakdown)
      : origin_(scene), gates_(gates), breakdown_(breakdown) {}

  void note_path(const Path& path) { origin_.note_path(path); }
  void add(int pixel, const Rgb& value, double length) {
    GatedImage& image = breakdown_.image;
    gates_.for_each_value(length, [&](int g, double w) {
      double* out = &image.data[image.index(pixel, origin_.bounces * gates_.size() + g)];
      double sum = 0;
      for (int c = 0; c < image.channels; ++c) {
        out[c] += w * value[c];
        sum += w * value[c];
      }
      for (int shape : origin_.shapes) breakdown_.by_shape[shape] += sum;
    });
  }

 private:
  PathOrigin origin_;
  const GateSet& gates_;
  ImageBreakdown& breakdown_;
};

class GradientBreakdownSink {
 public:
  static constexpr bool kDifferential = true;
  /// `adjoints`: [pixel][gate][channel][adjoint].
  GradientBreakdownSink(const PreparedScene& scene, const GateSet& gates, const TangentBasis& basis, int channels,
                        std::span<const double> adjoints, GradientBreakdown& breakdown)
      : origin_(scene),
        gates_(gates),
        rates_(scene.layout, basis),
        channels_(channels),
        adjoints_(adjoints),
        breakdown_(breakdown) {}

  void note_path(const Path& path) { origin_.note_path(path); }
  void note_boundary(int bounces, int triangle) { origin_.note_boundary(bounces, triangle); }
  void bind(const LocalDifferential& differential) { rates_.bind(differential); }

  void add(int pixel, const Rgb& value, double length, GateWeights use) {
    gates_.for_each_derivative(
        length, [&](int g, double w, double slope) { put(pixel, g, value, w * use.value, slope * use.slope); });
  }
  void add_length_rate(int pixel, int gate, const Rgb& value) { put(pixel, gate, value, 0, 1); }

 private:
  void put(int pixel, int gate, const Rgb& value, double w, double slope) {
    const int count = breakdown_.adjoints;
    const double* adjoint = &adjoints_[(static_cast<std::size_t>(pixel) * gates_.size() + gate) * channels_ * count];
    for (int c = 0; c < channels_; ++c, adjoint += count)
      for (int column : rates_.touched()) {
        const double derivative = value[c] * (w * rates_[column].log_f[c] + slope * rates_[column].length);
        double* sums = &breakdown_.by_bounces[breakdown_.index(origin_.bounces, column)];
        for (int j = 0; j < count; ++j) sums[j] += adjoint[j] * derivative;
        const double first = adjoint[0] * derivative;
        breakdown_.by_gate[static_cast<std::size_t>(gate) * breakdown_.columns + column] += first;
        for (int shape : origin_.shapes)
          breakdown_.by_shape[static_cast<std::size_t>(shape) * breakdown_.columns + column] += first;
      }
  }

  PathOrigin origin_;
  const GateSet& gates_;
  ColumnRates rates_;
  const int channels_;
  std::span<const double> adjoints_;
  GradientBreakdown& breakdown_;
};

}  // namespace isochron
