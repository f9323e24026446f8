// Where path contributions end up. A sink takes, for each path: the pixel, the path's value (contribution over
// density, per channel, without the gate), its length, and its local differential.
//   PrimalSink    gated images;
//   TangentSink   derivative images, one per column of the basis (one column: a tangent; all: the Jacobian);
//   AdjointSink   gradient over the degrees of freedom, weighted by dLoss/dImage.
#pragma once
#include <span>
#include <vector>

#include "core/base/sparse_sum.h"
#include "core/gates/gate.h"
#include "core/image/image.h"
#include "core/paths/path_differential.h"

namespace isochron {

/// How the gate enters a contribution: value * W d ln F + slope * W' dl.
struct GateWeights {
  double value = 1, slope = 1;
};
inline constexpr GateWeights kValueOnly{1, 0};

/// Where the values of a gated image are added up: in the image itself, or in a stretch of a sparse sum. What it refers to
/// must outlive it.
class Film {
 public:
  Film(GatedImage& image) : channels_(image.channels), gates_(image.gates), values_(image.data.data()) {}
  /// For an image of the shape of `shape`, whose values begin at `offset`.
  Film(const GatedImage& shape, SparseSum& sum, std::size_t offset)
      : channels_(shape.channels), gates_(shape.gates), sum_(&sum), offset_(offset) {}

  int channels() const { return channels_; }
  /// The channels' values.
  double* at(int pixel, int gate) const {
    const std::size_t index = (static_cast<std::size_t>(pixel) * gates_ + gate) * channels_;
    return values_ ? values_ + index : sum_->at(offset_ + index, channels_);
  }

 private:
  int channels_, gates_;
  double* values_ = nullptr;
  SparseSum* sum_ = nullptr;
  std::size_t offset_ = 0;
};

class PrimalSink {
 public:
  static constexpr bool kDifferential = false;
  PrimalSink(const GateSet& gates, const Film& film) : gates_(gates), film_(film) {}

  void add(int pixel, const Rgb& value, double length) {
    gates_.for_each_value(length, [&](int g, double w) {
      double* out = film_.at(pixel, g);
      for (int c = 0; c < film_.channels(); ++c) out[c] += w * value[c];
    });
  }

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

  void bind(const LocalDifferential& differential) {
    for (int column : touched_) rates_[column] = {};
    touched_.clear();
    for (const VertexGradient& v : differential.vertices)
      for (int axis = 0; axis < 3; ++axis)
        for_each_column(layout_.vertex(v.vertex, axis), [&](Rates& rates, double velocity) {
          for (double& f : rates.log_f) f += v.log_f[axis] * velocity;
          rates.length += v.length[axis] * velocity;
        });
    for (const ScalarGradient& s : differential.scalars)
      for_each_column(s.dof, [&](Rates& rates, double velocity) {
        for (int c = 0; c < 3; ++c)
          if (s.channel < 0 || s.channel == c) rates.log_f[c] += s.log_f * velocity;
        rates.length += s.length * velocity;
      });
  }

  const std::vector<int>& touched() const { return touched_; }
  const Rates& operator[](int column) const { return rates_[column]; }

 private:
  template <class F>
  void for_each_column(int dof, F&& f) {
    for (int i = basis_.row_begin[dof]; i < basis_.row_begin[dof + 1]; ++i) {
      const auto [column, coefficient] = basis_.entries[i];
      if (!rates_[column].touched) {
        rates_[column].touched = true;
        touched_.push_back(column);
      }
      f(rates_[column], coefficient);
    }
  }

  const DofLayout layout_;
  const TangentBasis& basis_;
  std::vector<Rates> rates_;
  std::vector<int> touched_;
};

class TangentSink {
 public:
  static constexpr bool kDifferential = true;
  /// One film per column.
  TangentSink(const GateSet& gates, const DofLayout& layout, const TangentBasis& basis, std::span<const Film> films)
      : gates_(gates), films_(films), rates_(layout, basis) {}

  /// The differential that the following contributions share.
  void bind(const LocalDifferential& differential) { rates_.bind(differential); }

  void add(int pixel, const Rgb& value, double length, GateWeights use) {
    gates_.for_each_derivative(length, [&](int g, double w, double slope) {
      for (int column : rates_.touched())
        splat(column, pixel, g, value, w * use.value, slope * use.slope * rates_[column].length);
    });
  }

  /// value * dl for one gate: a member of a coupled pair.
  void add_length_rate(int pixel, int gate, const Rgb& value) {
    for (int column : rates_.touched()) splat(column, pixel, gate, value, 0, rates_[column].length);
  }

 private:
  void splat(int column, int pixel, int g, const Rgb& value, double w, double length_part) {
    const Film& film = films_[column];
    double* out = film.at(pixel, g);
    for (int c = 0; c < film.channels(); ++c) out[c] += value[c] * (w * rates_[column].log_f[c] + length_part);
  }

  const GateSet& gates_;
  std::span<const Film> films_;
  ColumnRates rates_;
};

class AdjointSink {
 public:
  static constexpr bool kDifferential = true;
  /// `adjoint` is dLoss/dImage; `gradient` gets the degrees of freedom that the basis moves.
  AdjointSink(const GateSet& gates, const DofLayout& layout, const TangentBasis& basis, const GatedImage& adjoint,
              SparseSum& gradient)
      : gates_(gates), layout_(layout), basis_(basis), adjoint_(adjoint), gradient_(gradient) {}

  void bind(const LocalDifferential& differential) { differential_ = &differential; }

  void add(int pixel, const Rgb& value, double length, GateWeights use) {
    // All gates collapse into one function of length: a(l) = sum_g adjoint_g W_g(l), and its slope.
    Rgb weight;
    double slope_weight = 0;
    gates_.for_each_derivative(length, [&](int g, double w, double slope) {
      const double* a = &adjoint_.data[adjoint_.index(pixel, g)];
      for (int c = 0; c < adjoint_.channels; ++c) {
        weight[c] += a[c] * w * value[c];
        slope_weight += a[c] * slope * value[c];
      }
    });
    scatter(weight * use.value, slope_weight * use.slope);
  }

  void add_length_rate(int pixel, int gate, const Rgb& value) {
    const double* a = &adjoint_.data[adjoint_.index(pixel, gate)];
    double slope_weight = 0;
    for (int c = 0; c < adjoint_.channels; ++c) slope_weight += a[c] * value[c];
    scatter({}, slope_weight);
  }

 private:
  void scatter(const Rgb& weight, double slope_weight) {
    const double sum = weight.r + weight.g + weight.b;
    if (sum == 0 && slope_weight == 0 && weight.is_black()) return;
    for (const VertexGradient& v : differential_->vertices)
      for (int axis = 0; axis < 3; ++axis)
        if (const int dof = layout_.vertex(v.vertex, axis); basis_.moves(dof))
          gradient_.add(dof, sum * v.log_f[axis] + slope_weight * v.length[axis]);
    for (const ScalarGradient& s : differential_->scalars)
      if (basis_.moves(s.dof))
        gradient_.add(s.dof, (s.channel < 0 ? sum : weight[s.channel]) * s.log_f + slope_weight * s.length);
  }

  const GateSet& gates_;
  const DofLayout layout_;
  const TangentBasis& basis_;
  const GatedImage& adjoint_;
  SparseSum& gradient_;
  const LocalDifferential* differential_ = nullptr;
};

}  // namespace isochron
