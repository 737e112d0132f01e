#include "capture/calibrate/frame/origin.h"

#include <chrono>
#include <ctime>

namespace palpate {

Origin origin_now(const std::string& from, const std::string& note) {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return {from, text, note};
}

}  // namespace palpate
