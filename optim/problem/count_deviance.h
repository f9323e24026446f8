// The deviance of a single Poisson number from its mean, and what is to be expected of it.
//
// D(m, N) = 2 [G(m) - G(N) - N (L(m) - L(N))] is twice the Poisson loss of loss.h: with V(x) = max(x, floor), L' = 1 / V and
// G' = x / V, so that above the floor D = 2 (m - N + N ln(N / m)). Its mean over numbers N of the mean m, F(m), is far from the 1 of
// many counts where these are few: 0.5 at m = 0.14, 1.15 at m = 1.4.
#pragma once
#include <vector>

namespace isochron {

/// Of D(m, N), N a Poisson number of the mean m; all are central moments but the first.
struct DevianceMoments {
  double mean = 0;        ///< F(m)
  double covariance = 0;  ///< of D and N, which is m F'(m)
  double variance = 0;    ///< of D
  double third[3] = {};   ///< E D D D, E D D N, E D N N; E N N N is m
  double information =
      0;  ///< m h''(m), h(m) = F / 2 - G + m L: what an unknown that is fitted takes from D, per leverage
};

class CountDeviance {
 public:
  /// `floor` > 0 as ReadingLoss::scale; means above `largest` are not asked for.
  CountDeviance(double floor, double largest);

  double linear(double x) const;                     ///< G(x)
  double logarithm(double x) const;                  ///< L(x), 0 at 0
  double weight(double x) const;                     ///< 1 / V(x)
  double deviance(double mean, double count) const;  ///< D
  DevianceMoments moments(double mean) const;        ///< interpolated to about 1e-5 of a reading
  /// Sum over all numbers, to rounding.
  DevianceMoments exact_moments(double mean) const;

 private:
  double floor_;
  double first_;  ///< logarithm of the table's first mean
  std::vector<DevianceMoments> table_;
};

}  // namespace isochron
