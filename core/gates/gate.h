// Path-length importance of a time-gated camera (theory sections 1 and 3). All gates of an experiment share
// one shape, shifted to their centres: W_g(l) = shape(l - centre_g).
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "core/gates/bin_table.h"
#include "core/gates/linear_density.h"
#include "core/gates/normal.h"

namespace isochron {

/// Two lengths where the gate's derivative measure dW is negative (minus) and positive (plus), coupled by one
/// random number. Either side may be absent. Lengths are relative to the gate's centre, in scene units.
struct CoupledPair {
  double plus = 0, minus = 0;
  bool has_plus = false, has_minus = false;
  bool plus_is_jump = false, minus_is_jump = false;  ///< at a jump of the gate: reported under path_length
};

enum class GateKind { steady, gaussian, dirac, boxcar, truncated_gaussian, tabulated, bin, modulated };

/// Which part of dW a pair is drawn from. A side of the other part is absent from the pair, so that each part is the same
/// for every way of sampling and can be left out by itself. A jump that would be coupled with a slope, as at the jump of a
/// sawtooth, is split: each is sampled in its own term.
enum class PairPart {
  smooth,  ///< the continuous part: W', reported under `interior`
  dirac    ///< the jumps of the gate, reported under `path_length`
};

/// One gate shape centred at zero, with the four operations of theory section 3. Lengths in scene units,
/// values in 1 / scene unit; any scale works. The factories throw InputError where an argument is not finite,
/// a width is not positive or a table is not a gate.
class GateShape {
 public:
  /// 1 at every length.
  static GateShape steady();
  static GateShape gaussian(double sigma);
  static GateShape boxcar(double width);
  /// A Dirac measure. Its value is one at zero and stands for that measure: divided by `mass` it is the probability that a length
  /// drawn from the gate is zero, not a density. Only techniques that draw lengths from gates find paths.
  static GateShape dirac();
  /// The gaussian inside (-half_width, half_width), zero outside.
  static GateShape truncated_gaussian(double sigma, double half_width);
  /// Piecewise linear through (offset, value); a repeated offset is a jump; zero outside. Scaled to unit
  /// integral.
  static GateShape tabulated(const std::vector<double>& offsets, const std::vector<double>& values);
  /// A time bin [-width / 2, width / 2] of a detector whose response is the table (offset, value): how much later than it
  /// arrived light is counted. With r the response, scaled to unit integral,
  ///   W(l) = 1 / width  integral of r(t - l) over t in the bin,      W'(l) = [r(-width / 2 - l) - r(width / 2 - l)] / width.
  static GateShape bin(double width, const std::vector<double>& offsets, const std::vector<double>& values);
  /// cos(wavenumber x) at every length: not normalised, of either sign.
  static GateShape modulated(double wavenumber);

  GateKind kind() const { return kind_; }
  bool is_steady() const { return kind_ == GateKind::steady; }
  bool is_dirac() const { return kind_ == GateKind::dirac; }
  /// Counts light of every length, so that no length can be drawn from it: steady and modulated.
  bool is_unbounded() const { return kind_ == GateKind::steady || kind_ == GateKind::modulated; }
  /// Gaussian inside the support: the two kinds for which `gaussian_value` holds.
  bool is_gaussian_inside() const { return kind_ == GateKind::gaussian || kind_ == GateKind::truncated_gaussian; }
  /// Support [lower, upper] beyond which the value is zero (gaussian: below double rounding of its peak).
  double lower() const { return lower_; }
  double upper() const { return upper_; }
  /// Standard deviation of the gate as a density (the width that `auto` sampling goes by); unbounded gates:
  /// infinity.
  double width() const { return width_; }
  /// A length over which the gate changes little: its width; of a bin, the width without the response; of a modulated gate,
  /// the length that shifts its phase by one radian. Steady: infinity.
  double detail() const { return detail_; }
  /// Integral over the real line: 1, less what truncation took away. Unbounded gates: 1 by convention.
  double mass() const { return mass_; }

  struct ValueAndDerivative {
    double value = 0, derivative = 0;
  };
  double value(double x) const { return value_and_derivative(x).value; }
  /// Smooth part W'; at a kink of a table the slope to the right.
  double derivative(double x) const { return value_and_derivative(x).derivative; }
  ValueAndDerivative value_and_derivative(double x) const {
    if (!(x >= lower_ && x <= upper_)) return {};
    if (is_gaussian_inside()) {
      const double w = gaussian_value(x);
      return {w, slope_factor_ * x * w};
    }
    switch (kind_) {
      case GateKind::tabulated: {
        const LinearDensity::Knot& knot = table_.before(x);
        return {knot.value + knot.slope * (x - knot.offset), knot.slope};
      }
      case GateKind::bin:
        return between(table_.cumulated(begin_ - x), table_.cumulated(end_ - x));
      case GateKind::modulated:
        return {std::cos(wavenumber_ * x), -wavenumber_ * std::sin(wavenumber_ * x)};
      default:
        return {peak_, 0};
    }
  }
  /// Offset with density value / mass; u, v in (0, 1). A bin takes its response's delay from u and the position within
  /// the bin from v; other kinds take all from u. Not for unbounded gates, which are no densities.
  double sample(double u, double v) const;
  /// Mass of dW+ and of dW- that a pair of the given part stands for; zero for unbounded gates. Where a side is absent from
  /// some pairs, its part of dW has less. All kinds but bins with a response split dW into its positive and its negative part;
  /// those take r(begin - l) / width and r(end - l) / width, of which parts may cancel.
  double pair_mass(PairPart part) const { return parts_[static_cast<int>(part)].mass; }
  /// Draws from a part of positive mass; u in (0, 1).
  CoupledPair sample_pair(PairPart part, double u) const;

  /// The gaussian without its truncation, unchecked: x within a few supports.
  double gaussian_value(double x) const { return peak_ * fast_exp2(exponent_ * x * x); }
  /// W'(x) = factor * x * W(x) for the gaussian kinds.
  double gaussian_slope_factor() const { return slope_factor_; }

  /// Of a bin with a response: its ends, the response, and value and derivative of a bin from what the response has at
  /// (begin - l) and (end - l).
  double begin() const { return begin_; }
  double end() const { return end_; }
  const LinearDensity& response() const { return table_; }
  ValueAndDerivative between(const LinearDensity::Cumulated& begin, const LinearDensity::Cumulated& end) const {
    // Where the response is all but over, rounding could make the difference negative.
    return {std::max(end.below - begin.below, 0.0) * peak_, (begin.value - end.value) * peak_};
  }

 private:
  /// One sign of dW on a stretch of the quantile axis.
  struct Side {
    /// dirac: all at `from`. uniform: from -> to as the quantile runs 0 -> 1. rayleigh: from * rho, where rho
    /// follows the Rayleigh law cut where its distribution function is `to`. delayed: `from` less a delay of the response.
    enum class Form { dirac, uniform, rayleigh, delayed } form = Form::dirac;
    double from = 0, to = 0;
  };
  struct Segment {
    double mass = 0;
    Side plus, minus;
  };
  /// The segments a PairPart draws from, with the running sum of their masses as fractions of `mass`.
  struct Part {
    double mass = 0;
    std::vector<int> segments;
    std::vector<double> cumulative;
  };
  struct Piece {
    double mass;
    Side side;
  };

  /// Throws InputError, naming the argument.
  static void require_positive(double value, const char* name);
  double quantile(const Side& side, double u) const;
  void set_gaussian(double sigma, double cut);
  void couple_table();
  void couple_quantiles(const std::vector<Piece>& plus, const std::vector<Piece>& minus);
  void finish_parts();

  GateKind kind_ = GateKind::steady;
  double lower_ = 0, upper_ = 0, width_ = 0, detail_ = 0, mass_ = 1;
  double peak_ = 1;
  double sigma_ = 0, exponent_ = 0, slope_factor_ = 0;  ///< gaussian kinds: W = peak * 2^(exponent x^2)
  double outside_ = 0;                                  ///< gaussian kinds: mass cut off on either side
  LinearDensity table_;                                 ///< tabulated: the gate; bin: its response
  double begin_ = 0, end_ = 0;                          ///< bin
  double wavenumber_ = 0;                               ///< modulated
  std::vector<Segment> segments_;
  std::array<Part, 2> parts_;
};

/// All gates of an experiment: one shape at sorted or unsorted centres, scene units.
class GateSet {
 public:
  GateSet(GateShape shape, std::vector<double> centers);

  const GateShape& shape() const { return shape_; }
  int size() const { return static_cast<int>(centers_.size()); }
  double center(int g) const { return centers_[g]; }
  /// The same gates with all centres moved by `by` scene units: W_g(l - by). A detector that counts light later by the
  /// length t has readings W_g(l + t): shifted(-t).
  GateSet shifted(double by) const;
  /// Smallest and largest path length at which any gate is non-zero (unbounded gates: 0 and infinity).
  double lower() const { return lower_; }
  double upper() const { return upper_; }

  /// Calls f(gate, W_g(l)) for every gate whose support holds l.
  template <class F>
  void for_each_value(double l, F&& f) const {
    for_each_run(l, [&](const Run& run) {
      for (int k = 0; k < run.size; ++k) f(run.first + k, run.value[k]);
    });
  }
  /// Calls f(gate, W_g(l), W_g'(l)) for every gate whose support holds l.
  template <class F>
  void for_each_derivative(double l, F&& f) const {
    for_each_run(l, [&](const Run& run) {
      for (int k = 0; k < run.size; ++k) f(run.first + k, run.value[k], run.slope[k]);
    });
  }
  /// Gates first ... first + size - 1, what they make of a length, and zeros for what is left of `kRun`.
  static constexpr int kRun = BinTable::kRun;
  struct Run {
    int first = 0, size = 0;
    double value[kRun], slope[kRun];
  };
  /// The same in runs of neighbours, so that what is done with them can be vectorised.
  template <class F>
  void for_each_run(double l, F&& f) const {
    if (!bins_.empty()) {
      for_each_bin_run(l, f);
      return;
    }
    const auto [begin, end] = reaching(l);
    if (shape_.is_gaussian_inside()) {
      for_each_gaussian_run(l, begin, end, f);
    } else if (contiguous_) {
      for_each_neighbour(l, begin, end, f);
    } else {
      for (int i = begin; i < end; ++i) single(i, shape_.value_and_derivative(l - sorted_[i]), f);
    }
  }
  /// Standard deviation of the gates over the mean of their centres, where those below zero count as zero; unbounded gates:
  /// infinity.
  double relative_width() const;
  /// The same of all gates together, which overlap or not: how much of the path lengths they take in.
  double relative_coverage() const;

 private:
  /// Range in `sorted_` of the gates whose support holds l.
  std::pair<int, int> reaching(double l) const {
    const double first = l - shape_.upper(), last = l - shape_.lower();
    return {count_if_prefix([first](double center) { return center < first; }),
            count_if_prefix([last](double center) { return center <= last; })};
  }

  /// How many of the sorted centres fulfil a condition that the first ones do and the others do not: a binary search
  /// without branches, since lengths are random and no branch could be foreseen.
  template <class Condition>
  int count_if_prefix(Condition&& condition) const {
    const double* at = sorted_.data();
    int left = size();
    while (left > 1) {
      const int half = left / 2;
      at += condition(at[half - 1]) ? half : 0;
      left -= half;
    }
    return static_cast<int>(at - sorted_.data()) + (condition(*at) ? 1 : 0);
  }

  template <class F>
  void single(int i, const GateShape::ValueAndDerivative& w, F&& f) const {
    f(Run{order_[i], 1, {w.value}, {w.derivative}});
  }

  /// A run at a time, so that the exponentials vectorise.
  template <class F>
  void for_each_gaussian_run(double l, int begin, int end, F&& f) const {
    for (int i = begin; i < end; i += kRun) {
      Run run;
      for (int k = 0; k < kRun; ++k) {
        const double x = l - sorted_[i + k];
        run.value[k] = shape_.gaussian_value(x);
        run.slope[k] = shape_.gaussian_slope_factor() * x * run.value[k];
      }
      run.first = order_[i];
      run.size = std::min(kRun, end - i);
      if (in_order_) {
        for (int k = run.size; k < kRun; ++k) run.value[k] = run.slope[k] = 0;
        f(run);
      } else {
        for (int k = 0; k < run.size; ++k) single(i + k, {run.value[k], run.slope[k]}, f);
      }
    }
  }

  template <class F>
  void for_each_bin_run(double l, F&& f) const {
    if (!(l >= lower_ && l <= upper_)) return;
    // In widths of a bin, from the end of the first one to the earliest time at which light of length l may be counted.
    const double earliest = (l - sorted_[0] - shape_.upper()) * bins_per_length_, first = std::ceil(earliest);
    const BinTable::Row row = bins_.row((first - earliest) / bins_per_length_);
    const int gate = static_cast<int>(first);
    const int begin = std::max(0, -gate), end = std::min(row.size, size() - gate);
    for (int i = begin; i < end; i += kRun) {
      Run run;
      run.first = gate + i;
      run.size = std::min(kRun, end - i);
      for (int k = 0; k < kRun; ++k) {
        const double constant = row.constant[i + k], linear = row.linear[i + k], square = row.square[i + k];
        // Where the response is all but over, rounding could make the sum negative: its maximum with zero, without a branch.
        const double value = constant + row.along * linear + row.half_square * square;
        run.value[k] = 0.5 * (value + std::abs(value));
        run.slope[k] = -(linear + row.along * square);
      }
      for (int k = run.size; k < kRun; ++k) run.value[k] = run.slope[k] = 0;
      f(run);
    }
  }

  /// Bins of no common grid with the response's knots: neighbours share an edge, at which the response is looked up once.
  template <class F>
  void for_each_neighbour(double l, int begin, int end, F&& f) const {
    if (begin >= end) return;
    const LinearDensity& response = shape_.response();
    auto before = response.cumulated(sorted_[begin] + shape_.begin() - l);
    for (int i = begin; i < end; ++i) {
      const auto after = response.cumulated(sorted_[i] + shape_.end() - l);
      single(i, shape_.between(before, after), f);
      before = after;
    }
  }

  GateShape shape_;
  bool in_order_ = false;    ///< centres rise
  bool contiguous_ = false;  ///< bins with a response, each beginning where the one before ends
  BinTable bins_;            ///< of these, in order
  double bins_per_length_ = 0;
  std::vector<double> centers_;
  std::vector<double> sorted_;  ///< padded by a run, so that runs may go past the end
  std::vector<int> order_;
  double lower_ = 0, upper_ = 0;
};

}  // namespace isochron
