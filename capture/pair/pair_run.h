// Two fingers on one device and one clock: each has its own capture and engine, as any live session; what
// they measure meets in a matcher.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <string>

#include "capture/live/live.h"
#include "capture/live/session.h"
#include "capture/pair/pair_matcher.h"

namespace palpate {

/// Measurements of one finger's frame on the clock of both.
struct FingerTouch {
  Touch touch;
  int64_t time_ns = 0;  ///< exposure: CLOCK_MONOTONIC of a camera, a recording's own time otherwise
  int64_t host_ns = 0;  ///< exposure (or delivery), CLOCK_MONOTONIC; 0: not known
};

/// One finger as a live session of its own. Of the options' hooks `on_frame`, `interrupted` and those of a
/// lost device belong to the pair.
struct PairFinger {
  OpenSource open;
  MeasuredRun run;
  LiveOptions options;
  MakeViewer viewer = {};  ///< on the finger's thread, and ends once the run is interrupted; unset: none
};

/// A finger as it runs.
struct RunningFinger {
  LiveSession& session;
  LatencyLog& latency;  ///< of what is shown; receives each result that was taken
  const LiveOptions& options;
};

/// Whoever shows both fingers, on the caller's thread.
class PairViewer {
 public:
  virtual ~PairViewer() = default;
  /// Called again and again: takes the newest results (with LiveOptions::on_newest), where there are some (by
  /// Side; null: that finger gives none at present), shows them, and waits for some ms at most. False: the
  /// person has closed it. Throws DeviceLost where it finds that.
  virtual bool show(const std::array<RunningFinger*, 2>& fingers) = 0;
  /// Gives back all results of a finger that it holds, and tells what it has shown of it since it was asked
  /// last.
  virtual LiveReport let_go(Side side, RunningFinger& finger) = 0;
  /// The device is opened anew between these two; nothing of it may be used then.
  virtual void detach() = 0;
  virtual void attach() = 0;
};

struct PairOptions {
  PairViewer* viewer = nullptr;  ///< null: without a window
  double period_s = 1.0 / 30;    ///< of the slower finger; frames up to half of it apart make a pair
  /// Frames of one camera that wait for the other before they go out alone. Of two recordings none does: the
  /// one that is ahead waits.
  size_t most_waiting = 16;
  /// Every pair and every frame without a partner, in order, one call at a time, on a finger's thread.
  std::function<void(const Matched<FingerTouch>&)> on_pair;
  /// Why a finger gives no frames at present, as Source::state says it, or the error that it ended with;
  /// empty: it is back. On the caller's thread.
  std::function<void(Side, const std::string&)> on_state;
  std::function<bool()> interrupted;  ///< as LiveOptions has it
  std::function<void(uint64_t captured)>
      on_progress;  ///< frames of both, on the caller's thread, now and then
  std::function<void(const DeviceLost&)> on_device_lost;      ///< opened anew for both
  std::function<gpu::Context&(gpu::Context&)> reopen_device;  ///< as LiveOptions has it
};

struct PairReport {
  std::array<LiveReport, 2> fingers;
  SkewStatistics skew;
  std::array<uint64_t, 2> alone{};  ///< frames without a partner
  bool interrupted = false;
};

/// Measures both fingers until both have ended. One that fails or waits for its camera leaves the other
/// alone; its error is thrown at the end. A lost device is opened anew for both. Throws Error.
PairReport run_pair(gpu::Context& context, const std::array<PairFinger, 2>& fingers,
                    const PairOptions& options);

}  // namespace palpate
