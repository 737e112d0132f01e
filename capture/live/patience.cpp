#include "capture/live/patience.h"

namespace palpate {

bool Patience::over(const Source& source) {
  using Clock = std::chrono::steady_clock;
  state_ = source.state();
  if (state_.empty()) {
    silent_since_.reset();
    return false;
  }
  const Clock::time_point now = Clock::now();
  if (!silent_since_) silent_since_ = now;
  return std::chrono::duration<double>(now - *silent_since_).count() >= seconds_;
}

Error Patience::error() const {
  return {Failure::Device, "frames of " + input_, state_.substr(0, state_.find(';')),
          "plugging the camera in again and opening it anew, or more patience"};
}

}  // namespace palpate
