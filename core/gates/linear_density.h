// A density that is linear between the rows of a table: what a table says of a gate, or of a detector's response.
#pragma once
#include <algorithm>
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
  /// Whether knots are evenly spaced, but for kEven of a step.
  bool even() const { return even_; }
  static constexpr double kEven = 1e-9;

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
  /// The x up to which the integral is u; u in (0, 1).
  double quantile(double u) const;

 private:
  void index();

  std::vector<Knot> knots_;
  double lower_ = 0, upper_ = 0, deviation_ = 0;
  bool even_ = false;        ///< an interval is a bucket
  std::vector<int> guide_;   ///< bucket -> number of knots in the buckets before it; empty where even
  double bucket_scale_ = 0;  ///< buckets per length
  int last_bucket_ = 0, last_interval_ = 0;
};

}  // namespace isochron
