// The clocks that frames, rows and reports are stamped with.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

/// Now, on the clock of Frame::exposed_ns and delivered_ns (CLOCK_MONOTONIC).
int64_t monotonic_ns();

/// Date and time, ISO 8601, UTC: 2017-03-14T15:16:17Z.
std::string utc_now();

}  // namespace palpate
