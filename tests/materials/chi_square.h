// Chi-square of sampled directions, which fall into kSide x kSide bins, against probabilities.
#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/base/constants.h"

namespace isochron {

inline constexpr int kSide = 16, kSamples = 60000;

inline int bin(double u, double phi) {
  const double v = phi / kTwoPi - std::floor(phi / kTwoPi);
  return std::min(static_cast<int>(u * kSide), kSide - 1) * kSide + std::min(static_cast<int>(v * kSide), kSide - 1);
}

/// z of the chi-square of counts (the last bin holds the empty draws) against probabilities; thin bins are
/// pooled.
inline double chi_square_z(const std::vector<int>& counts, const std::vector<double>& probability) {
  double chi2 = 0, pooled_expected = 0, pooled_count = 0;
  int bins = 0;
  const auto add = [&](double count, double expected) {
    chi2 += (count - expected) * (count - expected) / expected;
    ++bins;
  };
  for (std::size_t k = 0; k < counts.size(); ++k) {
    const double expected = probability[k] * kSamples;
    if (expected >= 10) {
      add(counts[k], expected);
    } else {
      pooled_expected += expected;
      pooled_count += counts[k];
    }
  }
  if (pooled_expected >= 10) add(pooled_count, pooled_expected);
  if (pooled_expected < 10) {
    EXPECT_LT(pooled_count, 40);
  }
  return (chi2 - (bins - 1)) / std::sqrt(2.0 * (bins - 1));
}

}  // namespace isochron
