// Whether counts are those of equally likely bins.
#pragma once
#include <cmath>
#include <vector>

namespace isochron {

/// z of a chi-square statistic with many degrees of freedom is close to normal: |z| < 5 fails falsely once in 1e6.
inline double chi_square_z(const std::vector<int>& counts, double expected) {
  double chi2 = 0;
  for (const int c : counts) chi2 += (c - expected) * (c - expected) / expected;
  const double dof = static_cast<double>(counts.size()) - 1;
  return (chi2 - dof) / std::sqrt(2 * dof);
}

}  // namespace isochron
