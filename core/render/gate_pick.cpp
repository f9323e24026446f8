#include "core/render/gate_pick.h"

#include <cmath>

namespace isochron {

GatePick::GatePick(const GateSet& gates, const GatedImage& adjoint) : gates_(gates) {
  const int count = gates.size(), pixels = adjoint.width * adjoint.height;
  rows_.assign(static_cast<std::size_t>(pixels + 1) * count, 0.0);
  const auto normalise = [&](int pixel) {
    double* p = &rows_[row(pixel)];
    double sum = 0;
    for (int g = 0; g < count; ++g) sum += p[g];
    if (sum > 0)
      for (int g = 0; g < count; ++g) p[g] /= sum;
  };
  for (int pixel = 0; pixel < pixels; ++pixel) {
    for (int g = 0; g < count; ++g) {
      double sum = 0;
      for (int c = 0; c < adjoint.channels; ++c) sum += std::abs(adjoint.data[adjoint.index(pixel, g) + c]);
      rows_[row(pixel) + g] = sum;
      rows_[g] += sum;
    }
    normalise(pixel);
  }
  normalise(kImage);
}

int GatePick::sample_row(int pixel, double& u) const {
  const double* p = &rows_[row(pixel)];
  int last = -1;
  for (int g = 0; g < gates_.size(); ++g) {
    if (!(p[g] > 0)) continue;
    if (u < p[g]) {
      u /= p[g];
      return g;
    }
    u -= p[g];
    last = g;
  }
  if (last >= 0) u = 0.5;  // round-off has taken u past the end
  return last;
}

}  // namespace isochron
