// The engine's thread of a live session: measures what capture delivers and passes the results on.
#pragma once

#include <chrono>
#include <deque>

#include "capture/live/live_options.h"
#include "capture/live/session.h"
#include "palpate/pipeline.h"

namespace palpate {

/// Frames in the engine's hand, oldest first. A lost device leaves them unmeasured, for the one that follows.
using Pending = std::deque<CapturedPtr>;

class LiveEngine {
 public:
  /// All must outlive it.
  LiveEngine(LiveSession& session, Pipeline& pipeline, const LiveOptions& options, LatencyLog& latency,
             Pending& pending);

  /// Until no more frames come, the session stops or the device is lost. Throws what measuring does.
  void run();

 private:
  bool fetch(std::chrono::milliseconds patience);
  bool submit();
  void deliver(Result result);

  LiveSession& session_;
  Pipeline& pipeline_;
  const LiveOptions& options_;
  LatencyLog& latency_;
  Pending& pending_;
  size_t in_flight_ = 0;  ///< of the pending ones, the oldest
  uint64_t gaps_;         ///< before the frame that was submitted last
};

}  // namespace palpate
