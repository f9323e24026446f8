// Roots of quadratic equations.
#pragma once
#include <array>
#include <cmath>
#include <optional>

namespace isochron {

/// The real roots of a x^2 + 2 b x + c, each to full precision however close to zero; empty if there are none. A root that is at
/// infinity, or that a = b = 0 leaves open, is not finite.
inline std::optional<std::array<double, 2>> quadratic_roots(double a, double b, double c) {
  const double discriminant = b * b - a * c;
  if (!(discriminant >= 0)) return std::nullopt;
  const double q = -(b + std::copysign(std::sqrt(discriminant), b));
  return std::array{q / a, c / q};
}

}  // namespace isochron
