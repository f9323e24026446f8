// Where path contributions end up. A sink takes, for each path: the pixel, the path's value (contribution over
// density, per channel, without the gate), its length, and its local differential.
//   PrimalSink    gated images;
//   TangentSink   derivative images, one per column of the basis (one column: a tangent; all: the Jacobian);
//   AdjointSink   gradients over the degrees of freedom, weighted by dLoss/dImage of one loss or several.
// Breakdowns (breakdown_sinks.h) and the learning pass of the guiding (GuideSink) have sinks of their own.
#pragma once
#include <span>
#include <vector>

#include "core/base/sparse_sum.h"
#include "core/films/film.h"
#include "core/gates/gate.h"
#include "core/image/image.h"
#include "core/paths/path_differential.h"
#include "core/paths/technique.h"

namespace isochron {

/// How the gate enters the derivative of a contribution: W d ln F + W' dl, or its value W alone. Images take W.
enum class GateUse { value_and_slope, value_only };
/// What W' is multiplied by.
inline double slope_factor(GateUse use) {
  return use == GateUse::value_and_slope ? 1 : 0;
}

/// The interface that the estimators write to, see above. Not shared between threads.
class Sink {
 public:
  virtual ~Sink() = default;

  /// Whether contributions are derivatives: `bind` comes before them, and paths without a gradient may be left out.
  virtual bool differential() const = 0;

  /// What finds the paths of the next contributions.
  virtual void note_technique(Technique) {}
  /// The complete path (last vertex on an emitter) that the next contributions belong to.
  virtual void note_path(const Path&) {}
  /// The next contributions belong to a boundary segment at an edge of the triangle, on paths of so many bounces. `camera_part`: the
  /// weight of searches from the camera where both they and searches from edges may find it.
  virtual void note_boundary(int /*bounces*/, int /*triangle*/, double /*camera_part*/) {}
  /// Attributes the contributions since the last call to position x in (0, 1) of guide histogram `table`, see BoundaryGuide.
  virtual void note_guide(int /*table*/, double /*x*/) {}

  /// The differential that the next contributions share; lives until they are added.
  virtual void bind(const LocalDifferential&) {}
  /// One contribution, at a path length that the gates are to be evaluated for.
  virtual void add(int pixel, const Rgb& value, double length, GateUse use) = 0;
  /// value * dl for one gate, where contributions are derivatives: a member of a coupled pair.
  virtual void add_length_rate(int /*pixel*/, int /*gate*/, const Rgb& /*value*/) {}
};

class PrimalSink final : public Sink {
 public:
  PrimalSink(const GateSet& gates, const Film& film) : gates_(gates), film_(film) {}

  bool differential() const override { return false; }
  void add(int pixel, const Rgb& value, double length, GateUse use) override;

 private:
  const GateSet& gates_;
  const Film film_;
};

/// How fast ln F and the length change per unit of each column that a local differential touches.
class ColumnRates {
 public:
  struct Rates {
    double log_f[3] = {0, 0, 0};
    double length = 0;
    bool touched = false;
  };

  ColumnRates(const DofLayout& layout, const TangentBasis& basis)
      : layout_(layout), basis_(basis), rates_(basis.columns) {}

  void bind(const LocalDifferential& differential);

  const std::vector<int>& touched() const { return touched_; }
  const Rates& operator[](int column) const { return rates_[column]; }

 private:
  const DofLayout layout_;
  const TangentBasis& basis_;
  std::vector<Rates> rates_;
  std::vector<int> touched_;
};

class TangentSink final : public Sink {
 public:
  /// One film per column, of which there is one at least.
  TangentSink(const GateSet& gates, const DofLayout& layout, const TangentBasis& basis, std::span<const Film> films)
      : gates_(gates), films_(films), rates_(layout, basis) {}

  bool differential() const override { return true; }
  void bind(const LocalDifferential& differential) override { rates_.bind(differential); }
  void add(int pixel, const Rgb& value, double length, GateUse use) override;
  void add_length_rate(int pixel, int gate, const Rgb& value) override;

 private:
  void splat(int column, int pixel, int gate, const Rgb& value, double w, double length_part);

  const GateSet& gates_;
  std::span<const Film> films_;
  ColumnRates rates_;
};

/// So many adjoints are summed side by side, over the same paths. With four in place of one the stated errors and the verdict of scenes/rabbit
/// take 52 s in place of 89. Their images are all in memory.
inline constexpr int kAdjointsTogether = 4;

class AdjointSink final : public Sink {
 public:
  /// `adjoints` are dLoss/dImage of one loss or several, images of one shape. `gradient`, [degree of freedom][adjoint], gets those that the
  /// basis moves.
  AdjointSink(const GateSet& gates, const DofLayout& layout, const TangentBasis& basis,
              std::span<const GatedImage> adjoints, SparseSum& gradient)
      : gates_(gates), layout_(layout), basis_(basis), adjoints_(adjoints), gradient_(gradient) {}

  bool differential() const override { return true; }
  void bind(const LocalDifferential& differential) override { differential_ = &differential; }
  void add(int pixel, const Rgb& value, double length, GateUse use) override;
  void add_length_rate(int pixel, int gate, const Rgb& value) override;

 private:
  /// What an adjoint makes of a contribution: per unit of d ln F, by channel, and of dl.
  struct Pull {
    Rgb weight;
    double slope = 0;
  };

  /// Of N adjoints from `first` on, together.
  template <int N>
  void add(std::size_t first, int pixel, const Rgb& value, double length, GateUse use);
  template <int N>
  void scatter(std::size_t first, const Pull (&pulls)[N]);

  const GateSet& gates_;
  const DofLayout layout_;
  const TangentBasis& basis_;
  const std::span<const GatedImage> adjoints_;
  SparseSum& gradient_;
  const LocalDifferential* differential_ = nullptr;
};

}  // namespace isochron
