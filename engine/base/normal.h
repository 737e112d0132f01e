// Intervals of the normal distribution.
#pragma once

namespace palpate {

/// Half of the interval that holds 90 %, in standard deviations.
inline constexpr double kNormal90 = 1.645;

}  // namespace palpate
