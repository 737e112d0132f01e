// An MCAP file of what is measured live, written by a thread of its own: what it has no time for is dropped
// and counted, and never slows the engine.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "capture/mcap/recording.h"
#include "engine/base/clock.h"
#include "palpate/pipeline.h"

namespace palpate {

struct McapSinkOptions {
  size_t queue_bytes = size_t{64} << 20;  ///< of frames that wait; at least two fit
  /// Waits for room instead of dropping, until this says to give up; empty: drops.
  std::function<bool()> wait_unless = {};
};

struct McapStatus {
  uint64_t written = 0;  ///< frames; of a file that ended early those of its last chunk may be missing
  uint64_t dropped = 0;  ///< frames: the oldest that waited, or all since an error
  uint64_t bytes = 0;    ///< of the file
  std::string error;     ///< why the file has ended, one line; empty: it goes on
};

class McapSink {
 public:
  /// Throws Error(Failure::Output).
  McapSink(const std::filesystem::path& folder, McapOptions options, McapSinkOptions how = {});
  ~McapSink();  ///< closes

  /// Copies the frame, its touch and its depth. One thread.
  void add(const Frame& frame, const Result& result);
  McapStatus status() const;
  /// Writes what waits, and ends the file.
  McapStatus close();

 private:
  struct Item {
    Frame frame;
    Touch touch;
    std::vector<float> depth_mm;
    std::vector<uint16_t> confidence;
  };
  using ItemPtr = std::unique_ptr<Item>;

  bool make_room(size_t most);
  void run();
  void write(const Item& item);
  int64_t stamp_of(const Item& item) const;

  const McapSinkOptions how_;
  const double pitch_mm_per_px_;
  const WallClock clock_ = wall_clock();
  const int64_t begun_ns_;  ///< on CLOCK_MONOTONIC
  McapFile file_;
  McapRecording recording_;
  mutable std::mutex mutex_;
  std::condition_variable work_, room_;
  std::deque<ItemPtr> queue_;
  std::vector<ItemPtr> spare_;
  bool closing_ = false;
  McapStatus status_;
  std::thread writer_;
};

}  // namespace palpate
