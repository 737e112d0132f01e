// Mailbox for one item between two threads: the newest wins; a displaced item is handed back and counted.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <utility>

namespace palpate {

/// Any number of threads may put and take.
template <typename T>
class Mailbox {
 public:
  /// Never waits. Returns what was displaced (so that its owner can reuse it), or `item` itself once closed.
  std::optional<T> put(T item) {
    std::optional<T> displaced;
    {
      const std::lock_guard lock(mutex_);
      if (closed_) return item;
      displaced = std::exchange(item_, std::move(item));
      if (displaced) ++displaced_;
    }
    ready_.notify_one();
    return displaced;
  }

  /// Waits up to `timeout` until the last item is taken, so that nothing is displaced; false when it is not.
  bool wait_empty(std::chrono::microseconds timeout) {
    std::unique_lock lock(mutex_);
    return taken_.wait_for(lock, timeout, [this] { return !item_.has_value() || closed_; });
  }

  /// Waits up to `timeout` for an item. After close() what is still there can be taken.
  std::optional<T> take(std::chrono::microseconds timeout) {
    std::unique_lock lock(mutex_);
    ready_.wait_for(lock, timeout, [this] { return item_.has_value() || closed_; });
    taken_.notify_one();
    return std::exchange(item_, std::nullopt);
  }

  /// Nothing more will come; wakes every waiting thread.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    ready_.notify_all();
    taken_.notify_all();
  }

  /// Closed and empty: nothing will ever be taken again.
  bool finished() const {
    const std::lock_guard lock(mutex_);
    return closed_ && !item_;
  }
  /// Items that were never taken because a newer one came.
  uint64_t displaced() const {
    const std::lock_guard lock(mutex_);
    return displaced_;
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable ready_;
  std::condition_variable taken_;
  std::optional<T> item_;
  bool closed_ = false;
  uint64_t displaced_ = 0;
};

}  // namespace palpate
