// Sine and cosine of a fraction of a full turn, for sampling directions.
#pragma once
#include <cmath>

namespace isochron {

struct SineCosine {
  double sine, cosine;
};

/// Sine and cosine of 2 pi u for |u| up to 2^20, absolute error below 3e-16. A full turn needs no reduction
/// by an irrational number: the nearest quarter turn is exact, and Taylor polynomials do the rest, |x| <=
/// pi/4. No branches.
inline SineCosine sincos_2pi(double u) {
  constexpr double kRound = 0x1.8p52;  // adding it leaves round(4u) in the low bits of the sum
  const double quarter = (4 * u + kRound) - kRound;
  const double x = 6.283185307179586477 * (u - 0.25 * quarter), z = x * x;
  // Coefficients (-1)^k / (2k+1)! and (-1)^k / (2k)!; the first terms left out are below 2^-54.
  double s = -7.6471637318198164759e-13;
  s = s * z + 1.6059043836821614599e-10;
  s = s * z - 2.5052108385441718775e-8;
  s = s * z + 2.7557319223985890653e-6;
  s = s * z - 1.9841269841269841270e-4;
  s = s * z + 8.3333333333333333333e-3;
  s = s * z - 1.6666666666666666667e-1;
  s = x + x * z * s;
  double c = 4.7794773323873852974e-14;
  c = c * z - 1.1470745597729724714e-11;
  c = c * z + 2.0876756987868098979e-9;
  c = c * z - 2.7557319223985890653e-7;
  c = c * z + 2.4801587301587301587e-5;
  c = c * z - 1.3888888888888888889e-3;
  c = c * z + 4.1666666666666666667e-2;
  c = 1 + z * (c * z - 0.5);
  const int q = static_cast<int>(quarter);
  const double sine = q & 1 ? c : s, cosine = q & 1 ? s : c;
  return {q & 2 ? -sine : sine, (q + 1) & 2 ? -cosine : cosine};
}

}  // namespace isochron
