#include "engine/base/clock.h"

#include <chrono>
#include <ctime>

namespace palpate {

int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

WallClock wall_clock() {
  constexpr int kTries = 8;
  const auto date_ns = [] {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(
               std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
  WallClock best;
  for (int i = 0; i < kTries; ++i) {
    const int64_t before = monotonic_ns(), date = date_ns(), after = monotonic_ns();
    const int64_t error = (after - before + 1) / 2;
    if (i == 0 || error < best.error_ns) best = {date - (before + (after - before) / 2), error};
  }
  return best;
}

std::string utc_now() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm parts{};
  gmtime_r(&now, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

}  // namespace palpate
