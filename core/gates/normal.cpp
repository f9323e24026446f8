#include "core/gates/normal.h"

#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/constants.h"

namespace isochron {
namespace {

constexpr double kCentralFrom = 0.02425;

/// Polynomial with its leading coefficient first.
template <std::size_t N>
double horner(const std::array<double, N>& coefficients, double x) {
  double p = 0;
  for (const double c : coefficients) p = p * x + c;
  return p;
}

/// Acklam's rational approximation, relative error 1.15e-9.
double approximate_quantile(double tail, double from_half) {
  constexpr std::array kTailUp{-7.784894002430293e-03, -3.223964580411365e-01, -2.400758277161838e+00,
                               -2.549732539343734e+00, 4.374664141464968e+00,  2.938163982698783e+00};
  constexpr std::array kTailDown{7.784695709041462e-03, 3.224671290700398e-01, 2.445134137142996e+00,
                                 3.754408661907416e+00, 1.0};
  constexpr std::array kCentreUp{-3.969683028665376e+01, 2.209460984245205e+02,  -2.759285104469687e+02,
                                 1.383577518672690e+02,  -3.066479806614716e+01, 2.506628277459239e+00};
  constexpr std::array kCentreDown{-5.447609879822406e+01, 1.615858368580409e+02,  -1.556989798598866e+02,
                                   6.680131188771972e+01,  -1.328068155288572e+01, 1.0};
  if (tail < kCentralFrom) {
    const double q = std::sqrt(-2 * std::log(tail));
    return horner(kTailUp, q) / horner(kTailDown, q);
  }
  const double r = from_half * from_half;
  return horner(kCentreUp, r) * from_half / horner(kCentreDown, r);
}

}  // namespace

double normal_quantile_lower(double tail, double from_half) {
  const double x = approximate_quantile(tail, from_half);
  // One Halley step on the side where the residual keeps its relative accuracy.
  const double scaled = x * std::sqrt(0.5);
  const double residual = tail < kCentralFrom ? 0.5 * std::erfc(-scaled) - tail : 0.5 * std::erf(scaled) - from_half;
  const double step = residual * std::sqrt(kTwoPi) * std::exp(0.5 * x * x);
  return x - step / (1 + 0.5 * x * step);
}

}  // namespace isochron
