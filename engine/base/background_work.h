// A thread for slow work, so that the window never waits for a disk.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace palpate {

class BackgroundWork {
 public:
  BackgroundWork();
  /// Does what is queued first.
  ~BackgroundWork();
  BackgroundWork(const BackgroundWork&) = delete;
  BackgroundWork& operator=(const BackgroundWork&) = delete;

  /// In order, one at a time. What the work returns, or the message of what it throws, is a note for the
  /// person; empty: none.
  void add(std::function<std::string()> work);
  /// The newest note since the last call.
  std::optional<std::string> take_note();
  /// Waits until all is done.
  void finish();

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<std::string()>> queue_;
  std::optional<std::string> note_;
  bool busy_ = false;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace palpate
