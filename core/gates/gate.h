// Path-length importance of a time-gated camera (theory sections 1 and 3). All gates of an experiment share one
// shape, shifted to their centres: W_g(l) = shape(l - centre_g).
#pragma once
#include <string>
#include <vector>

#include "core/math/vec.h"

namespace isochron {

/// Two lengths where the gate's derivative measure dW is negative (minus) and positive (plus), coupled by one random
/// number. Either side may be absent. Lengths are relative to the gate's centre, in scene units.
struct CoupledPair {
  double plus = 0, minus = 0;
  bool has_plus = false, has_minus = false;
  bool plus_is_jump = false, minus_is_jump = false;  ///< an atom of dW: reported under path_length
};

enum class GateKind { steady, gaussian, boxcar, truncated_gaussian, tabulated };

/// Which part of dW a pair is drawn from.
enum class PairPart {
  smooth,  ///< segments with at least one continuous side (the `interior` pass of ellipsoidal sampling)
  jumps,   ///< segments whose both sides are atoms (the `path_length` pass of ellipsoidal sampling)
  atoms    ///< every atom; continuous partners are dropped (the `path_length` pass of standard sampling)
};

/// One gate shape centred at zero, with the four operations of theory section 3.
class GateShape {
 public:
  static GateShape steady();
  static GateShape gaussian(double sigma);
  static GateShape boxcar(double width);
  static GateShape truncated_gaussian(double sigma, double half_width);
  /// Piecewise linear through (offset, value); a repeated offset is a jump; zero outside. Scaled to unit integral.
  static GateShape tabulated(std::vector<double> offsets, std::vector<double> values);

  GateKind kind() const { return kind_; }
  bool is_steady() const { return kind_ == GateKind::steady; }
  /// Support [lower, upper] beyond which the value is zero (gaussian: below double rounding of its peak).
  double lower() const { return lower_; }
  double upper() const { return upper_; }
  /// Standard deviation of the gate seen as a density (the width that `auto` sampling looks at).
  double width() const { return width_; }
  /// Integral over the real line: 1, less what truncation took away.
  double mass() const { return mass_; }

  double value(double x) const;
  double derivative(double x) const;  ///< smooth part W'
  double sample(double u) const;      ///< offset with density value / mass; u in (0, 1)
  double pair_mass(PairPart part) const;
  CoupledPair sample_pair(PairPart part, double u) const;

 private:
  /// A stretch of the quantile axis on which both sides of dW are of one simple form.
  struct Side {
    enum class Form { none, atom, rising_gaussian, falling_gaussian, uniform } form = Form::none;
    double from = 0, to = 0;  ///< atom: offset in `from`; uniform: from -> to as the quantile runs 0 -> 1
  };
  struct Segment {
    double mass = 0;
    Side plus, minus;
  };
  double quantile(const Side& side, double u) const;
  void add_segment(const Segment& segment);

  GateKind kind_ = GateKind::steady;
  double lower_ = 0, upper_ = 0, width_ = 0, mass_ = 1;
  double sigma_ = 0, peak_ = 1;
  std::vector<double> offsets_, values_, cumulative_;
  std::vector<Segment> segments_;
  double part_mass_[3] = {0, 0, 0};
};

/// All gates of an experiment: one shape at sorted or unsorted centres, scene units.
class GateSet {
 public:
  GateSet(GateShape shape, std::vector<double> centers);

  const GateShape& shape() const { return shape_; }
  int size() const { return static_cast<int>(centers_.size()); }
  double center(int g) const { return centers_[g]; }
  /// Smallest and largest path length at which any gate is non-zero (steady: 0 and infinity).
  double lower() const { return lower_; }
  double upper() const { return upper_; }

  /// Calls f(gate, W_g(l)) for every gate whose support holds l.
  template <class F>
  void for_each_value(double l, F&& f) const {
    for (int i = first_reaching(l); i < size() && sorted_[i] + shape_.lower() <= l; ++i)
      f(order_[i], shape_.value(l - sorted_[i]));
  }
  /// Calls f(gate, W_g(l), W_g'(l)) for every gate whose support holds l.
  template <class F>
  void for_each_derivative(double l, F&& f) const {
    for (int i = first_reaching(l); i < size() && sorted_[i] + shape_.lower() <= l; ++i) {
      const double x = l - sorted_[i];
      f(order_[i], shape_.value(x), shape_.derivative(x));
    }
  }
  /// Density of a length drawn by choosing a gate uniformly and then a length from it.
  double mixture_pdf(double l) const;

 private:
  /// Position in `sorted_` of the first gate whose upper end is at or beyond l.
  int first_reaching(double l) const;

  GateShape shape_;
  std::vector<double> centers_, sorted_;
  std::vector<int> order_;
  double lower_ = 0, upper_ = 0;
};

}  // namespace isochron
