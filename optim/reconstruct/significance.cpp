#include "optim/reconstruct/significance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace isochron {

double normal_quantile_above(double probability) {
  double low = 0, high = 40;  // beyond, a double holds no probability
  for (int i = 0; i < 200 && low < high; ++i) {
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::numbers::sqrt2) > probability ? low : high) = middle;
  }
  return high;
}

double surface_threshold(std::vector<float> values) {
  std::sort(values.begin(), values.end(), [](float a, float b) { return std::abs(a) > std::abs(b); });
  long right = 0, most = 0;
  double threshold = 0;
  for (const float value : values) {
    right += value > 0 ? 1 : -2;
    if (right > most) {
      most = right;
      threshold = value;
    }
  }
  return threshold;
}

}  // namespace isochron
