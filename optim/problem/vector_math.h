// Small sums over vectors of numbers.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

namespace isochron {

inline double mean(const std::vector<double>& values) {
  double sum = 0;
  for (double v : values) sum += v;
  return sum / static_cast<double>(values.size());
}

/// Middle of the values, which are not empty; the mean of the two middle ones where their number is even.
inline double median(std::vector<double> values) {
  const std::size_t middle = values.size() / 2;
  std::sort(values.begin(), values.end());
  return values.size() % 2 == 1 ? values[middle] : (values[middle - 1] + values[middle]) / 2;
}

inline double dot(const std::vector<double>& a, const std::vector<double>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

/// Euclidean.
inline double norm(const std::vector<double>& v) {
  double sum = 0;
  for (double x : v) sum += x * x;
  return std::sqrt(sum);
}

/// The point that lies `part` of the way from one to another.
inline std::vector<double> part_way(const std::vector<double>& from, std::vector<double> to, double part) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] = from[i] + part * (to[i] - from[i]);
  return to;
}

/// The gradient but for what leads beyond the bounds.
inline std::vector<double> within_bounds(std::vector<double> gradient, const std::vector<double>& theta,
                                         const std::vector<double>& lower, const std::vector<double>& upper) {
  for (std::size_t i = 0; i < gradient.size(); ++i)
    if ((theta[i] <= lower[i] && gradient[i] > 0) || (theta[i] >= upper[i] && gradient[i] < 0)) gradient[i] = 0;
  return gradient;
}

}  // namespace isochron
