// Two functions of the normal law that gates need: a fast exponential and the quantile.
#pragma once
#include <bit>
#include <cstdint>

namespace isochron {

/// 2^y for y in [-1020, 0], relative error below 1e-14. Free of branches and calls, so that loops over it
/// vectorise; any finite y outside the range gives a meaningless value but no trap.
inline double fast_exp2(double y) {
  constexpr double kRound = 0x1.8p52;  // adding it leaves round(y) in the low bits of the sum
  const double shifted = y + kRound;
  const double r = y - (shifted - kRound);
  // Taylor coefficients ln(2)^k / k!; the first term left out is below 1e-14 for |r| <= 1/2.
  double p = 4.4455382718708114976e-10;
  p = p * r + 7.0549116208011233299e-9;
  p = p * r + 1.0178086009239699728e-7;
  p = p * r + 1.3215486790144309488e-6;
  p = p * r + 1.5252733804059840280e-5;
  p = p * r + 1.5403530393381609954e-4;
  p = p * r + 1.3333558146428443423e-3;
  p = p * r + 9.6181291076284771620e-3;
  p = p * r + 5.5504108664821579953e-2;
  p = p * r + 2.4022650695910071233e-1;
  p = p * r + 6.9314718055994530942e-1;
  p = p * r + 1.0;
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(p) + (std::bit_cast<std::uint64_t>(shifted) << 52));
}

/// The x at which the standard normal's distribution function is P, given twice over so that neither the
/// centre nor the lower tail loses digits: `tail` = P in (0, 1/2] and `from_half` = P - 1/2. Accurate to a
/// few ulp.
double normal_quantile_lower(double tail, double from_half);

}  // namespace isochron
