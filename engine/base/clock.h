// The clocks that frames, rows and reports are stamped with.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

/// Now, on the clock of Frame::exposed_ns and delivered_ns (CLOCK_MONOTONIC).
int64_t monotonic_ns();

/// By how much the clock of the date (CLOCK_REALTIME) is ahead of CLOCK_MONOTONIC now, and the most that this
/// is wrong by: half of the time in which both were read. It changes where somebody sets the date.
struct WallClock {
  int64_t ahead_ns = 0;
  int64_t error_ns = 0;
};
WallClock wall_clock();

/// Date and time, ISO 8601, UTC: 2017-03-14T15:16:17Z.
std::string utc_now();

}  // namespace palpate
