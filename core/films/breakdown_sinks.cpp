#include "core/films/breakdown_sinks.h"

#include <algorithm>

namespace isochron {

void SortingSink::note_path(const Path& path) {
  bounces_ = path.size() - 2;
  shapes_.clear();
  for (int i = 1; i < path.size(); ++i) add_shape(path.vertex[i].triangle);
}

void SortingSink::note_boundary(int bounces, int triangle, double) {
  bounces_ = bounces;
  shapes_.clear();
  add_shape(triangle);
}

void SortingSink::add_shape(int triangle) {
  if (is_light(triangle)) return;
  const int shape = scene_.shape_index(triangle);
  if (std::find(shapes_.begin(), shapes_.end(), shape) == shapes_.end()) shapes_.push_back(shape);
}

void ImageBreakdownSink::add(int pixel, const Rgb& value, double length, GateUse) {
  GatedImage& image = breakdown_.image;
  gates_.for_each_value(length, [&](int g, double w) {
    double* out = &image.data[image.index(pixel, bounces_ * gates_.size() + g)];
    double sum = 0;
    for (int c = 0; c < image.channels; ++c) {
      out[c] += w * value[c];
      sum += w * value[c];
    }
    for (int shape : shapes_) breakdown_.by_shape[shape] += sum;
    breakdown_.by_technique[technique_] += sum;
  });
}

void GradientBreakdownSink::add(int pixel, const Rgb& value, double length, GateUse use) {
  gates_.for_each_derivative(
      length, [&](int g, double w, double slope) { add_to_gate(pixel, g, value, w, slope_factor(use) * slope); });
}

void GradientBreakdownSink::add_to_gate(int pixel, int gate, const Rgb& value, double w, double slope) {
  const int count = breakdown_.adjoints;
  const double* adjoint = &adjoints_[(static_cast<std::size_t>(pixel) * gates_.size() + gate) * channels_ * count];
  for (int c = 0; c < channels_; ++c, adjoint += count)
    for (int column : rates_.touched()) {
      const double derivative = value[c] * (w * rates_[column].log_f[c] + slope * rates_[column].length);
      double* sums = &breakdown_.by_bounces[breakdown_.index(bounces_, column)];
      for (int j = 0; j < count; ++j) sums[j] += adjoint[j] * derivative;
      const double first = adjoint[0] * derivative;
      breakdown_.by_gate[static_cast<std::size_t>(gate) * breakdown_.columns + column] += first;
      for (int shape : shapes_)
        breakdown_.by_shape[static_cast<std::size_t>(shape) * breakdown_.columns + column] += first;
      breakdown_.by_technique[technique_ * breakdown_.columns + column] += first;
    }
}

}  // namespace isochron
