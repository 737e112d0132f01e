// What passes from a stream's threads to its reader: the results that wait, and the one in hand.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <exception>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>

#include "viz/python/errors.h"

namespace palpate::python {

/// A stream that is closed at the interpreter's end.
class Closable {
 public:
  Closable() = default;
  virtual ~Closable() = default;
  Closable(const Closable&) = delete;
  Closable& operator=(const Closable&) = delete;
  /// Ends its threads; the last result expires. Any thread, any number of times.
  virtual void close() = 0;
};

/// The reader's side of a stream of `Item`s.
template <typename Item>
class Handover : public Closable {
 public:
  std::mutex& mutex() { return mutex_; }
  std::condition_variable& changed() { return changed_; }
  /// Under mutex(), before it is waited for ready(): the item that was taken last expires.
  void ask() {
    if (given_) expire(*given_);
    given_.reset();
    released_.notify_all();
  }
  /// Under mutex(): whether take() has an answer.
  bool ready() const { return !results_.empty() || finished_ || closed_; }
  /// Under mutex(): the next item, null after the last. Rethrows what ended the stream.
  std::shared_ptr<Item> take() {
    check_open("reading within `with palpate.open(...)`");
    if (results_.empty()) {
      if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
      return nullptr;
    }
    given_ = std::move(results_.front());
    results_.pop_front();
    ++delivered_;
    released_.notify_all();
    return given_;
  }
  bool closed() const { return closed_; }
  uint64_t delivered() const { return delivered_; }

 protected:
  /// Under mutex(), as all that has results_, given_, finished_ and failure_.
  virtual void expire(Item& item) = 0;
  void check_open(const char* remedy) const {
    if (closed_) throw Refusal{"ExpiredError", "an open stream", "a closed one", remedy};
  }
  /// A line of a log beside what `recording` records. Throws Refusal where it is null.
  template <typename Recorder>
  void log_to(Recorder* recording, const std::string& name, std::string_view line) const {
    check_open("logging within `with palpate.open(...)`");
    if (!recording)
      throw bad_argument("a stream that is recorded, to log beside it", "none",
                         "palpate.open(..., record=\"out/press1\")");
    recording->log(name, line);
  }
  /// `item` waits for the reader; one that waits already is passed over.
  void offer_newest(std::shared_ptr<Item> item) {
    if (!results_.empty()) {
      expire(*results_.front());
      results_.pop_front();
      ++passed_over_;
    }
    results_.push_back(std::move(item));
  }
  /// With the exception that is being handled.
  void fail() {
    const std::lock_guard lock(mutex_);
    failure_ = std::current_exception();
  }
  void finish() {
    {
      const std::lock_guard lock(mutex_);
      finished_ = true;
    }
    changed_.notify_all();
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_, released_;
  std::deque<std::shared_ptr<Item>> results_;
  std::shared_ptr<Item> given_;  ///< the one that was taken last
  bool finished_ = false;
  std::exception_ptr failure_;
  std::atomic<bool> closed_ = false;
  std::atomic<uint64_t> delivered_ = 0, passed_over_ = 0;
};

}  // namespace palpate::python
