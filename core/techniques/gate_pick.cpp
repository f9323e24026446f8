#include "core/techniques/gate_pick.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/base/parallel.h"

namespace isochron {

GatePick::GatePick(const GateSet& gates, std::span<const GatedImage> adjoints, bool lengths, double mean_rate)
    : gates_(gates) {
  const int count = gates.size(), pixels = adjoints[0].pixels();
  if (lengths) below_.assign(static_cast<std::size_t>(pixels + 1) * (count + 1), 0.0);
  // Makes probabilities of weights; returns their sum.
  const auto accumulate = [&](double* p) {
    for (int g = 0; g < count; ++g) p[g + 1] += p[g];
    const double sum = p[count];
    if (sum > 0)
      for (int g = 1; g <= count; ++g) p[g] = g == count ? 1 : p[g] / sum;
    return sum;
  };
  rate_.assign(pixels, 0.0);
  constexpr int kChunk = 1024;  // pixels; sums do not depend on the number of threads
  std::vector<std::vector<double>> of_chunk((pixels + kChunk - 1) / kChunk, std::vector<double>(count + 1, 0.0));
  parallel(static_cast<int>(of_chunk.size()), [&](int chunk) {
    std::vector<double> alone;
    double* const of_all = of_chunk[chunk].data() + 1;
    for (int pixel = chunk * kChunk; pixel < std::min((chunk + 1) * kChunk, pixels); ++pixel) {
      if (!lengths) alone.assign(count + 1, 0.0);
      double* p = lengths ? &below_[row(pixel)] : alone.data();
      for (const GatedImage& adjoint : adjoints) {
        const double* values = &adjoint.data[adjoint.index(pixel, 0)];
        for (int c = 0; c < adjoint.channels; ++c)
          for (int g = 0; g < count; ++g) p[g + 1] += std::abs(values[g * adjoint.channels + c]);
      }
      for (int g = 0; g < count; ++g) of_all[g] += p[g + 1];
      rate_[pixel] = lengths ? accumulate(p) : std::accumulate(p, p + count + 1, 0.0);
    }
  });
  std::vector<double> of_image(count + 1, 0.0);
  for (const std::vector<double>& each : of_chunk)
    for (int g = 1; g <= count; ++g) of_image[g] += each[g];
  const double all = accumulate(of_image.data());
  if (lengths) std::copy(of_image.begin(), of_image.end(), below_.begin() + static_cast<std::ptrdiff_t>(row(kImage)));
  if (all > 0)
    for (double& rate : rate_) rate *= mean_rate * pixels / all;
}

int GatePick::sample_row(int pixel, double& u) const {
  const double* p = &below_[row(pixel)];
  const int count = gates_.size();
  if (!(p[count] > 0)) return -1;
  const int gate = static_cast<int>(std::upper_bound(p + 1, p + count, u) - p) - 1;
  u = (u - p[gate]) / (p[gate + 1] - p[gate]);
  return gate;
}

}  // namespace isochron
