// Which gate a connection's length is drawn for, and how many samples a pixel gets. Images: every gate and every pixel
// equally. Gradients of a loss: gates with probability proportional to the sum of |dLoss/dImage| over the pixel that the
// connection serves, or over the whole image for connections of the camera itself, which may land on any pixel. Pixels get
// samples in proportion to that sum over their gates.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "core/gates/gate.h"
#include "core/image/image.h"

namespace isochron {

class GatePick {
 public:
  /// In place of a pixel: the whole image.
  static constexpr int kImage = -1;

  /// Every gate alike. `gates` must outlive this.
  explicit GatePick(const GateSet& gates) : gates_(gates) {}
  /// `lengths`: whether lengths are drawn. Without, only rate() may be called, and no table of the size of an image is made.
  /// Several adjoints, images of one shape, count with the sum of their magnitudes. `mean_rate`: of rate(), the share of the pixels that
  /// have samples.
  GatePick(const GateSet& gates, std::span<const GatedImage> adjoints, bool lengths, double mean_rate);
  /// Of the tables that draw lengths, in bytes.
  static double table_bytes(int pixels, int gates) { return sizeof(double) * (pixels + 1.0) * (gates + 1.0); }

  bool uniform() const { return below_.empty(); }
  /// Gate for a pixel (or kImage); `u` in (0, 1) is replaced by a fresh uniform number. -1 where no gate
  /// counts.
  int sample(int pixel, double& u) const {
    if (below_.empty()) {
      const double scaled = u * gates_.size();
      const int gate = std::min(static_cast<int>(scaled), gates_.size() - 1);
      u = scaled - gate;
      return gate;
    }
    return sample_row(pixel, u);
  }
  /// Samples of the pixel over their mean number. 0 for pixels that do not count.
  double rate(int pixel) const { return rate_.empty() ? 1 : rate_[pixel]; }
  double probability(int pixel, int gate) const {
    return below_.empty() ? 1.0 / gates_.size() : below_[row(pixel) + gate + 1] - below_[row(pixel) + gate];
  }
  /// Length drawn by picking a gate and then a length from it; empty where no gate counts. What is left of
  /// `pick` places the length in its bin, so that evenly spread picks are evenly spread over all bins. Not for unbounded gates.
  std::optional<double> sample_length(int pixel, double pick, double u) const {
    const int gate = sample(pixel, pick);
    if (gate < 0) return std::nullopt;
    return gates_.center(gate) + gates_.shape().sample(u, pick);
  }
  /// Density of `sample_length`.
  double length_pdf(int pixel, double length) const {
    double sum = 0;
    gates_.for_each_value(length, [&](int gate, double w) { sum += probability(pixel, gate) * w; });
    return sum / gates_.shape().mass();
  }

 private:
  int sample_row(int pixel, double& u) const;
  std::size_t row(int pixel) const { return static_cast<std::size_t>(pixel + 1) * (gates_.size() + 1); }

  const GateSet& gates_;
  std::vector<double>
      below_;  ///< cumulative probabilities from 0; the image's row first, then one per pixel; empty: uniform
  std::vector<double> rate_;  ///< empty: uniform
};

}  // namespace isochron
