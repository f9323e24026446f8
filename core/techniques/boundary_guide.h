// Guiding of the visibility term: where the boundary points of each technique are drawn from, as histograms over primary
// sample space, and how often each technique is used. Learned once in a short pass of its own and then frozen, so
// estimates stay unbiased.
#pragma once
#include <array>
#include <vector>

#include "core/base/random.h"
#include "core/gates/gate.h"
#include "core/paths/path_differential.h"
#include "core/scene/camera_model.h"

namespace isochron {

/// Piecewise constant density on (0, 1).
class Warp {
 public:
  /// Uniform.
  Warp() : below_{0, 1} {}
  /// Equal bins by their probabilities, which sum to one and are positive.
  explicit Warp(const std::vector<double>& probability);
  /// Maps a uniform u in (0, 1) to a number of this density.
  double sample(double u) const;
  double density(double x) const {
    const int i = bin(x);
    return (below_[i + 1] - below_[i]) * bins();
  }
  /// Probability of (0, x).
  double below(double x) const {
    const int i = bin(x);
    return below_[i] + (below_[i + 1] - below_[i]) * (x * bins() - i);
  }

 private:
  int bins() const { return static_cast<int>(below_.size()) - 1; }
  int bin(double x) const { return std::min(static_cast<int>(x * bins()), bins() - 1); }
  std::vector<double> below_;
};

/// What the learning pass notes about a technique: where contributions came from, and their squares.
struct GuideRecord {
  int table;
  double x;       ///< in (0, 1): the boundary point's place in the unguided distribution
  double square;  ///< summed over pixels, gates, columns and colours
};

class BoundaryGuide {
 public:
  enum Technique { primary, pixel_border, from_edge, from_camera };
  static constexpr int kTechniques = 4;

  /// One value for each technique.
  template <class T>
  using Each = std::array<T, kTechniques>;

  /// Unguided: a sample of the visibility term is one search by one of the techniques that can find anything, all equally
  /// often.
  explicit BoundaryGuide(const Each<bool>& possible);
  /// From the records of as many unguided searches by each possible technique and what these cost, in any unit. The
  /// mean cost of a sample stays about that of an unguided one.
  BoundaryGuide(const Each<bool>& possible, const std::vector<GuideRecord>& records, const Each<double>& cost);

  /// How often a technique is used per sample, on average; 0 where it finds nothing.
  double rate(Technique t) const { return rate_[t]; }
  /// The histogram of a technique; `from_camera` has one per tile of the image for D next to the camera, and one for
  /// all others.
  const Warp& warp(int table) const { return warps_[table]; }
  static int table(Technique t) { return t; }
  static int table_from_camera(const CameraModel& camera, int pixel, int bounces) {
    if (bounces > 1) return from_camera;
    const int x = pixel % camera.width * kTiles / camera.width, y = pixel / camera.width * kTiles / camera.height;
    return kTechniques + y * kTiles + x;
  }

 private:
  static constexpr int kTiles = 4;  ///< across the image, either way
  static constexpr int kTables = kTechniques + kTiles * kTiles;
  std::vector<Warp> warps_;
  Each<double> rate_;
};

/// Sink of the learning pass. What one search adds to the same value of the same image is summed before it is squared: the
/// two sides of a boundary cancel in part.
class GuideSink {
 public:
  static constexpr bool kDifferential = true;
  GuideSink(const GateSet& gates, const DofLayout& layout, const TangentBasis& basis)
      : gates_(gates), layout_(layout), basis_(basis), sums_(gates.size()) {}

  void bind(const LocalDifferential& differential) {
    rate_ = 0;
    for (const VertexGradient& v : differential.vertices)
      for (int axis = 0; axis < 3; ++axis) {
        const int dof = layout_.vertex(v.vertex, axis);
        for (int i = basis_.row_begin[dof]; i < basis_.row_begin[dof + 1]; ++i)
          rate_ += sign(basis_.entries[i].column) * v.log_f[axis] * basis_.entries[i].coefficient;
      }
  }
  template <class Use>
  void add(int pixel, const Rgb& value, double length, Use) {
    if (pixel != pixel_) square_sums();
    pixel_ = pixel;
    gates_.for_each_value(length, [&](int gate, double w) {
      sums_[gate] += value * (w * rate_);
      touched_.push_back(gate);
    });
  }
  /// What was added since the last call came from place x of a table.
  void note(int table, double x) {
    square_sums();
    if (square_ > 0) records.push_back({table, x, square_});
    square_ = 0;
    ++sample_;
  }

  std::vector<GuideRecord> records;

 private:
  /// The square of a sum of columns with random signs is, on average, the sum of their squares.
  double sign(int column) const {
    if (basis_.columns == 1) return 1;
    const auto bits = philox({static_cast<std::uint32_t>(column) / 32, sample_, 0, 0}, {0x7369676eu, 0});
    return bits[0] >> (column % 32) & 1 ? 1 : -1;
  }
  void square_sums() {
    for (const int gate : touched_) {
      const Rgb& sum = sums_[gate];
      square_ += sum.r * sum.r + sum.g * sum.g + sum.b * sum.b;
      sums_[gate] = Rgb();
    }
    touched_.clear();
  }

  const GateSet& gates_;
  const DofLayout layout_;
  const TangentBasis& basis_;
  std::vector<Rgb> sums_;     ///< of the current pixel, by gate
  std::vector<int> touched_;  ///< gates that were added to; repeats do no harm
  int pixel_ = -1;
  double rate_ = 0, square_ = 0;
  std::uint32_t sample_ = 0;
};

/// Tells a learning sink where contributions came from; others do not ask.
template <class Sink>
void note_guide(Sink& sink, int table, double x) {
  if constexpr (requires { sink.note(table, x); }) sink.note(table, x);
}

}  // namespace isochron
