// Guiding of the visibility term: where the boundary points of each technique are drawn from, as histograms over primary
// sample space, and how often each technique is used. Learned once in a short pass of its own and then frozen, so
// estimates stay unbiased.
#pragma once
#include <array>
#include <vector>

#include "core/films/sinks.h"
#include "core/paths/technique.h"
#include "core/scene/sensors/pinhole.h"

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
  double x;                ///< in (0, 1): the boundary point's place in the unguided distribution
  double square;           ///< summed over pixels, gates, unknowns and colours
  double camera_part = 0;  ///< see Sink::note_boundary
};

class BoundaryGuide {
 public:
  static constexpr int kSearches = 5;

  /// One value for each technique that searches for boundaries, by table().
  template <class T>
  using Each = std::array<T, kSearches>;

  /// Unguided: a sample of the visibility term is one search by one of the techniques that can find anything, all equally
  /// often.
  explicit BoundaryGuide(const Each<bool>& possible);
  /// From the records of as many unguided searches by each possible technique and what these cost, in any unit. The
  /// mean cost of a sample stays about that of an unguided one.
  BoundaryGuide(const Each<bool>& possible, const std::vector<GuideRecord>& records, const Each<double>& cost);

  /// How often a technique is used per sample, on average; 0 where it finds nothing.
  double rate(Technique t) const { return rate_[table(t)]; }
  /// The histogram of a technique; `from_camera` has one per tile of the image for D next to the camera, and one for
  /// all others.
  const Warp& warp(int table) const { return warps_[table]; }
  static constexpr int table(Technique t) { return static_cast<int>(t) - static_cast<int>(Technique::primary_edge); }
  static_assert(static_cast<int>(Technique::from_camera) - static_cast<int>(Technique::primary_edge) == kSearches - 1);
  static int table_from_camera(const CameraModel& camera, int pixel, int bounces) {
    if (bounces > 1) return table(Technique::from_camera);
    const int x = pixel % camera.width * kTiles / camera.width, y = pixel / camera.width * kTiles / camera.height;
    return kSearches + y * kTiles + x;
  }

 private:
  static constexpr int kTiles = 4;  ///< across the image, either way
  static constexpr int kTables = kSearches + kTiles * kTiles;
  std::vector<Warp> warps_;
  Each<double> rate_;
};

/// Sink of the learning pass. What one search adds to the same value of the same image is summed before it is squared: the
/// two sides of a boundary cancel in part.
class GuideSink final : public Sink {
 public:
  GuideSink(const GateSet& gates, const DofLayout& layout, const TangentBasis& basis)
      : gates_(gates), layout_(layout), basis_(basis), sums_(gates.size()) {}

  bool differential() const override { return true; }
  void note_boundary(int, int, double camera_part) override { camera_part_ = camera_part; }
  void note_guide(int table, double x) override;
  void bind(const LocalDifferential& differential) override;
  void add(int pixel, const Rgb& value, double length, GateUse use) override;

  std::vector<GuideRecord> records;

 private:
  double column_sign(int column) const;
  void square_sums();

  const GateSet& gates_;
  const DofLayout layout_;
  const TangentBasis& basis_;
  std::vector<Rgb> sums_;     ///< of the current pixel, by gate
  std::vector<int> touched_;  ///< gates that were added to; repeats do no harm
  int pixel_ = -1;
  double rate_ = 0, square_ = 0;
  /// Of the next contributions, of the current sums, and, times their squares, of all sums of the search.
  double camera_part_ = 0, part_of_sums_ = 0, part_of_square_ = 0;
  std::uint32_t sample_ = 0;
};

}  // namespace isochron
