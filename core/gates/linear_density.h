// A density that is linear between the rows of a table: what a table says of a gate, or of a detector's response.
#pragma once
#include <algorithm>
#include <span>
#include <string>
#include <vector>

namespace isochron {

class LinearDensity {
 public:
  struct alignas(32) Knot {
    double offset = 0, value = 0;
    double slope = 0;  ///< of the interval after the knot; zero at a jump
    double below = 0;  ///< integral up to the knot
  };
  /// Value at x and integral up to x.
  struct Cumulated {
    double value = 0, below = 0;
  };

  LinearDensity() = default;
  /// Through (offset, value); a repeated offset is a jump; zero outside. Scaled to unit integral. Throws InputError where that is
  /// no density; `what` names the table in messages, such as "gate's table".
  LinearDensity(const std::vector<double>& offsets, const std::vector<double>& values, const std::string& what);

  double lower() const { return lower_; }
  double upper() const { return upper_; }
  double deviation() const { return deviation_; }  ///< the standard deviation
  const std::vector<Knot>& knots() const { return knots_; }

  /// The knot that begins the interval, of positive length, that holds x in [lower, upper]. Where knots are evenly spaced, x
  /// within rounding of a knot may get the interval on either side.
  const Knot& before(double x) const {
    const int bucket = std::min(static_cast<int>((x - lower_) * bucket_scale_), last_bucket_);
    if (even_) return knots_[bucket];
    // The guide narrows the search to the knots of one bucket.
    const auto first = knots_.begin();
    const auto above = [](double at, const Knot& knot) { return at < knot.offset; };
    const auto i = std::upper_bound(first + guide_[bucket], first + guide_[bucket + 1], x, above) - first;
    return knots_[std::min(static_cast<int>(i) - 1, last_interval_)];
  }
  Cumulated cumulated(double x) const {
    if (!(x > lower_)) return {0, 0};
    if (!(x < upper_)) return {0, 1};
    const Knot& knot = before(x);
    const double along = x - knot.offset, value = knot.value + knot.slope * along;
    return {value, knot.below + 0.5 * along * (knot.value + value)};
  }
  /// The number of knots between x and x + length; 0 where it is not whole or not the same for every x.
  int stride(double length) const;
  /// `cumulated` at a row of points `stride` knots apart: their distance from the knot before them is the same, and only the
  /// first point's knot has to be looked up.
  class Comb {
   public:
    /// `first` is at least lower().
    Comb(const LinearDensity& table, double first, int stride)
        : knots_(table.knots_), next_(static_cast<int>((first - table.lower_) * table.bucket_scale_)), stride_(stride) {
      along_ = first - table.lower_ - next_ / table.bucket_scale_;
      half_square_ = 0.5 * along_ * along_;
    }
    Cumulated next() {
      if (next_ + 1 >= static_cast<int>(knots_.size())) return {0, 1};
      const Knot& knot = knots_[next_];
      next_ += stride_;
      return {knot.value + knot.slope * along_, knot.below + knot.value * along_ + knot.slope * half_square_};
    }

   private:
    std::span<const Knot> knots_;
    int next_, stride_;
    double along_, half_square_;
  };
  /// The x up to which the integral is u; u in (0, 1).
  double quantile(double u) const;

 private:
  void index();

  std::vector<Knot> knots_;
  double lower_ = 0, upper_ = 0, deviation_ = 0;
  bool even_ = false;        ///< whether knots are evenly spaced: an interval is a bucket
  std::vector<int> guide_;   ///< bucket -> number of knots in the buckets before it; empty where even
  double bucket_scale_ = 0;  ///< buckets per length
  int last_bucket_ = 0, last_interval_ = 0;
};

}  // namespace isochron
