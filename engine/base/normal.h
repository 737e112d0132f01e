// Intervals of the normal distribution.
#pragma once

namespace palpate {

/// Half of the interval that holds 90 %, in standard deviations.
inline constexpr double kNormal90 = 1.645;

/// Standard errors by which a normal value has to lie above a bound to exceed it nine times in ten.
inline constexpr double kNineInTen = 1.28;

}  // namespace palpate
