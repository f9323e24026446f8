#include "optim/reconstruct/significance.h"

#include <algorithm>
#include <cmath>

#include "core/gates/normal.h"

namespace isochron {

double normal_quantile_above(double probability) {
  return -normal_quantile_lower(probability, probability - 0.5);
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
