#pragma once
#include <numbers>

namespace isochron {
inline constexpr double kPi = std::numbers::pi;
inline constexpr double kTwoPi = 2 * std::numbers::pi;
inline constexpr double kInvPi = std::numbers::inv_pi;
}  // namespace isochron
