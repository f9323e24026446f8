#include "optim/problem/student.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace isochron {
namespace {

/// Probability that |t| exceeds x.
double two_sided_tail(double x, int degrees) {
  const double angle = std::atan(x / std::sqrt(static_cast<double>(degrees)));
  const double cosine2 = std::cos(angle) * std::cos(angle);
  const bool odd = degrees % 2 == 1;
  // Terms cos^k (even degrees: k = 0, 2, ...; odd: k = 1, 3, ...) up to k = degrees - 2.
  double term = odd ? std::cos(angle) : 1, sum = 0;
  for (int k = odd ? 1 : 0; k <= degrees - 2; k += 2) {
    sum += term;
    term *= cosine2 * (k + 1) / (k + 2);
  }
  const double inside = odd ? 2 / std::numbers::pi * (angle + std::sin(angle) * sum) : std::sin(angle) * sum;
  return 1 - inside;
}

constexpr int kNormal = 1000;  ///< within a hundredth of the quantile of the normal law

int whole_degrees(double degrees) {
  return static_cast<int>(std::clamp(degrees, 1.0, static_cast<double>(kNormal)));
}

}  // namespace

double student_quantile(double tail, double degrees) {
  const int whole = whole_degrees(degrees);
  double low = 0, high = 1;
  while (two_sided_tail(high, whole) > tail) low = high, high *= 2;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (two_sided_tail(middle, whole) > tail ? low : high) = middle;
  }
  return high;
}

double student_quantile_95(double degrees) {
  thread_local std::array<double, kNormal + 1> known{};
  double& quantile = known[whole_degrees(degrees)];
  if (quantile == 0) quantile = student_quantile(0.05, degrees);
  return quantile;
}

}  // namespace isochron
