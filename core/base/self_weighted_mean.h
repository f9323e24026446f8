// The mean of albedos over the light that comes from them.
#pragma once

namespace isochron {

/// The sum of squares over the sum: each value weighs by itself, so that what is nearly dark does not count.
class SelfWeightedMean {
 public:
  /// Not below zero. `area`: of what has this value, in any unit.
  void add(double value, double area = 1) {
    sum_ += area * value;
    squares_ += area * value * value;
  }
  /// Zero where nothing is above zero.
  double mean() const { return sum_ > 0 ? squares_ / sum_ : 0; }

 private:
  double sum_ = 0, squares_ = 0;
};

}  // namespace isochron
