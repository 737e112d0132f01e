// Numbers that many sources call by name.
#pragma once

#include <limits>
#include <numbers>

namespace palpate {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

}  // namespace palpate
