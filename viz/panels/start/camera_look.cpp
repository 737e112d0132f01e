#include "viz/panels/start/camera_look.h"

#include <chrono>
#include <exception>
#include <stdexcept>
#include <utility>

#include "viz/panels/start/thumbnails.h"

namespace palpate::viz {

void CameraLook::start(const std::string& input) {
  stop();
  input_ = input;
  ends_ = false;
  thread_ = std::thread([this, input] {
    try {
      run(input);
    } catch (const std::exception& e) {
      const std::lock_guard lock(mutex_);
      failure_ = e.what();
    }
  });
}

void CameraLook::stop() {
  ends_ = true;
  if (thread_.joinable()) thread_.join();
  input_.clear();
  trouble_.clear();
  picture_.reset();
  newest_.reset();
  failure_.reset();
}

bool CameraLook::update() {
  const std::lock_guard lock(mutex_);
  if (failure_)
    trouble_ = *std::exchange(failure_, {});
  else if (newest_)
    picture_ = std::exchange(newest_, {});
  else
    return false;
  return true;
}

void CameraLook::run(const std::string& input) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kBetween{100};  // the list is drawn no more often
  const std::unique_ptr<Source> source = open_(input);
  source->watch([this] { return ends_.load(); });
  Frame frame;
  Clock::time_point due{};
  while (!ends_ && source->next(frame)) {
    if (Clock::now() < due) continue;
    due = Clock::now() + kBetween;
    RgbImage picture = thumbnail_of(frame);
    const std::lock_guard lock(mutex_);
    newest_ = std::move(picture);
  }
  if (!ends_) throw std::runtime_error("the camera sends no more pictures");
}

}  // namespace palpate::viz
