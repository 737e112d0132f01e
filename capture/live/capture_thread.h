// The capture thread of a live session: takes frames from the source at their pace, records and passes them
// on.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <vector>

#include "capture/live/live_options.h"
#include "capture/live/session.h"

namespace palpate {

class LiveCapture {
 public:
  /// All must outlive it. `open` is called at each start of a loop.
  LiveCapture(LiveSession& session, const OpenSource& open, const LiveOptions& options);

  /// Until the source ends, the limit of frames is reached or the session stops. Throws what the source does.
  void run();

 private:
  using Clock = std::chrono::steady_clock;

  CapturedPtr empty_frame();
  bool fetch(Frame& frame);
  bool at_end();
  bool paused();
  void wait_until_due(const Frame& frame);
  void deliver(CapturedPtr item);

  LiveSession& session_;
  const OpenSource& open_;
  const LiveOptions& options_;
  std::vector<CapturedPtr> spare_;
  Clock::duration period_;  ///< of frames without times
  Clock::time_point due_ = Clock::now();
  int64_t last_time_ns_ = 0;  ///< as the source reported it
  bool paced_ = false;        ///< last_time_ns_ is that of the frame before
  uint64_t gaps_ = 0;
  bool gap_pending_ = false;  ///< before a frame that went nowhere
  // Across the seams of a loop time and numbers go on.
  int64_t loop_offset_ns_ = 0;
  uint64_t in_this_round_ = 0;
  uint64_t sequence_ = 0;
};

}  // namespace palpate
