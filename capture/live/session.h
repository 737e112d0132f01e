// Shared state of the threads of a live session: two mailboxes forwards, a tray back.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "capture/live/latency.h"
#include "capture/live/mailbox.h"
#include "capture/live/patience.h"
#include "capture/source.h"
#include "palpate/device.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"

namespace palpate {

struct Captured {
  Frame frame;
  uint64_t gaps = 0;  ///< interruptions of the stream up to here: dropped frames may have carried the mark
  uint64_t position = 0;  ///< in its source, from 0; a session's frames have other numbers
  bool leased = false;    ///< was handed to the engine in its driver's memory
};
using CapturedPtr = std::unique_ptr<Captured>;

struct Measured {
  CapturedPtr captured;
  Result result;
  FrameTimes times;
};

/// Things handed back to the thread that owns them.
template <typename T>
class ReturnTray {
 public:
  void put(T item) {
    {
      const std::lock_guard lock(mutex_);
      items_.push_back(std::move(item));
    }
    returned_.notify_all();
  }
  std::vector<T> take_all() {
    const std::lock_guard lock(mutex_);
    return std::exchange(items_, {});
  }
  /// Until something comes back, `timeout` at most.
  void wait(std::chrono::microseconds timeout) {
    std::unique_lock lock(mutex_);
    returned_.wait_for(lock, timeout);
  }

 private:
  std::mutex mutex_;
  std::condition_variable returned_;
  std::vector<T> items_;
};

/// Player's controls of a recording: the user's requests to the thread that reads it, and its position.
/// Frames count from 0.
struct Transport {
  static constexpr int64_t kNowhere = -1;
  std::atomic<double> speed{1};            ///< of the recording's own time
  std::atomic<int64_t> seek_to{kNowhere};  ///< frame to go to, taken by the reader
  std::atomic<int> steps{0};               ///< frames to go, forwards or back, while paused
  /// The part that is played again and again, both ends in it; kNowhere: all is played once.
  std::atomic<int64_t> part_first{kNowhere}, part_last{kNowhere};
  std::atomic<uint64_t> position{0};  ///< frame that was delivered last
  std::atomic<bool> at_end{false};
};

/// State shared by the threads. Threads end when `stop` is set or their input is finished; the first error
/// wins. After an error that leaves the frames before it good, these are measured and shown first.
struct LiveSession {
  LiveSession() = default;
  explicit LiveSession(Patience patience) : patience_(std::move(patience)) {}
  ~LiveSession() {
    if (source_) source_->watch([] { return false; });  // it may outlive the session
  }

  Mailbox<CapturedPtr> to_engine;
  Mailbox<Measured> to_display;
  ReturnTray<CapturedPtr> frames;  ///< back to capture, which fills them again
  std::atomic<bool> stop{false};
  /// The device is lost: engine and viewer end what they do on it, capture goes on.
  std::atomic<bool> device_lost{false};
  std::atomic<uint32_t> device_losses{0};  ///< after which it was opened anew
  std::atomic<bool> paused{false};
  std::atomic<bool> track_anew{false};  ///< the object's motion is to count from the next frame
  std::atomic<uint64_t> captured{0};
  std::atomic<uint64_t> passed_over{0};  ///< captured, but the recorder had no room: not measured either
  std::atomic<uint64_t> processed{0};
  std::atomic<uint64_t> copies{
      0};  ///< of whole frames by the processor, from the source's memory to the engine's
  Transport transport;

  /// Where frames come from at present; another object in each round of a loop. It stops waiting with the
  /// session.
  std::shared_ptr<Source> source() const {
    const std::lock_guard lock(mutex_);
    return source_;
  }
  void use(std::shared_ptr<Source> source) {
    source->watch([this, from = source.get()] { return stop.load() || out_of_patience(*from); });
    const std::lock_guard lock(mutex_);
    source_ = std::move(source);
  }

  /// Nothing more is done on this device.
  bool ending() const { return stop || device_lost; }
  /// Frees the slot of a result, and its frame goes back to capture.
  void give_back(Measured& measured) {
    measured.result = Result();
    frames.put(std::move(measured.captured));
  }

  void fail(std::exception_ptr error) {
    const std::lock_guard lock(mutex_);
    if (!error_) error_ = std::move(error);
  }
  /// Called by engine or viewer, which both may find it.
  void lose_device(const DeviceLost& error) {
    const std::lock_guard lock(mutex_);
    if (!device_error_) device_error_ = error;
    device_lost = true;
  }
  /// Its error; with it the session may go on, on a device that was opened anew. Empty: none was lost.
  std::optional<DeviceLost> take_device_error() {
    const std::lock_guard lock(mutex_);
    device_lost = false;
    return std::exchange(device_error_, std::nullopt);
  }
  bool failed() const {
    const std::lock_guard lock(mutex_);
    return error_ != nullptr;
  }
  void rethrow() const {
    const std::lock_guard lock(mutex_);
    if (error_) std::rethrow_exception(error_);
  }

 private:
  bool out_of_patience(const Source& source) {
    if (!patience_.over(source)) return false;
    fail(std::make_exception_ptr(patience_.error()));
    return true;
  }

  Patience patience_;  ///< of the thread that takes frames
  mutable std::mutex mutex_;
  std::exception_ptr error_;
  std::optional<DeviceLost> device_error_;
  std::shared_ptr<Source> source_;
};

}  // namespace palpate
