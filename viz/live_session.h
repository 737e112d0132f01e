// What the threads of a live session share: two mailboxes onwards, two trays back.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "engine/frame.h"
#include "engine/pipeline.h"
#include "viz/mailbox.h"

namespace palpate::viz {

struct Captured {
  Frame frame;
  std::chrono::steady_clock::time_point at;  ///< when the source delivered it
};
using CapturedPtr = std::unique_ptr<Captured>;

struct Measured {
  CapturedPtr captured;
  Result result;
};

/// Things handed back to the thread that owns them.
template <typename T>
class ReturnTray {
 public:
  void put(T item) {
    const std::lock_guard lock(mutex_);
    items_.push_back(std::move(item));
  }
  std::vector<T> take_all() {
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }

 private:
  std::mutex mutex_;
  std::vector<T> items_;
};

/// What the threads share. Threads end when `stop` is set or their input is finished; the first error wins.
struct LiveSession {
  Mailbox<CapturedPtr> to_engine;
  Mailbox<Measured> to_display;
  ReturnTray<Result> results;      ///< back to the engine, which releases their slots
  ReturnTray<CapturedPtr> frames;  ///< back to capture, which fills them again
  std::atomic<bool> stop{false};
  std::atomic<bool> paused{false};
  std::atomic<uint64_t> captured{0};
  std::atomic<uint64_t> processed{0};

  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
  }
  void rethrow() {
    const std::lock_guard lock(mutex_);
    if (error_) std::rethrow_exception(error_);
  }

 private:
  std::mutex mutex_;
  std::exception_ptr error_;
};

}  // namespace palpate::viz
