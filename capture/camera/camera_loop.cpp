#include "capture/camera/camera_loop.h"

#include <chrono>
#include <thread>

#include "engine/base/clock.h"
#include "palpate/error.h"

namespace palpate {

bool CameraLoop::next(Frame& frame) {
  frame.give_back();
  while (!cancelled || !cancelled()) {
    if (!is_open()) {
      come_back();
      continue;
    }
    switch (take(frame)) {
      case Event::Ready:
        return true;
      case Event::Gone:
        let_go("the camera was unplugged");
        continue;
      case Event::Broken:
        start_again("the camera's stream failed");
        continue;
      case Event::Nothing:
        break;
    }
    if (log.silent(timeout_ns)) start_again(log.words_of_silence(timeout_ns));
  }
  return false;
}

/// False, after a short rest, where the last try was a moment ago.
bool CameraLoop::waited() {
  const int64_t now = monotonic_ns();
  const bool due = now - tried_ns_ >= pause_ns_;
  if (due)
    tried_ns_ = now;
  else
    std::this_thread::sleep_for(std::chrono::milliseconds(kWait_ms));
  return due;
}

void CameraLoop::start_again(const std::string& why) {
  log.interrupt(why + "; starting the stream again");
  // A stream that fails as soon as it starts is not tried without end in one go.
  if (!waited()) tried_ns_ = monotonic_ns();
  log.note_start();
  if (!restart()) let_go(why);
}

void CameraLoop::let_go(const std::string& why) {
  log.interrupt(why + "; waiting for the camera");
  close();
  tried_ns_ = monotonic_ns();
}

void CameraLoop::come_back() {
  if (!waited()) return;
  try {
    std::string but;
    if (reopen(but)) log.say("the camera is back" + (but.empty() ? "" : ", but " + but));
  } catch (const Error& error) {
    log.say(std::string("the camera is back, but: ") + error.what());
  }
}

}  // namespace palpate
