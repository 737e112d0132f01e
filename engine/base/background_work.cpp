#include "engine/base/background_work.h"

#include <exception>
#include <utility>

namespace palpate {

BackgroundWork::BackgroundWork() : thread_([this] { run(); }) {}

BackgroundWork::~BackgroundWork() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void BackgroundWork::add(std::function<std::string()> work) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(work));
  }
  changed_.notify_all();
}

std::optional<std::string> BackgroundWork::take_note() {
  const std::lock_guard lock(mutex_);
  return std::exchange(note_, std::nullopt);
}

void BackgroundWork::finish() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return queue_.empty() && !busy_; });
}

void BackgroundWork::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return stop_ || !queue_.empty(); });
    if (queue_.empty()) return;
    const std::function<std::string()> work = std::move(queue_.front());
    queue_.pop_front();
    busy_ = true;
    lock.unlock();
    std::string note;
    try {
      note = work();
    } catch (const std::exception& e) {
      note = e.what();  // a full disk must not end a measurement
    }
    lock.lock();
    busy_ = false;
    if (!note.empty()) note_ = std::move(note);
    changed_.notify_all();
  }
}

}  // namespace palpate
