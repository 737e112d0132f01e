// What an interval of a normal distribution holds.
#pragma once

namespace palpate {

/// Half of the interval that holds 90 %, in standard deviations.
inline constexpr double kNormal90 = 1.645;

}  // namespace palpate
