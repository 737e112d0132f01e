#include "capture/live/engine_thread.h"

#include <cmath>
#include <utility>

#include "capture/live/recorder.h"
#include "engine/base/trace.h"

namespace palpate {

using std::chrono::milliseconds;

LiveEngine::LiveEngine(LiveSession& session, Pipeline& pipeline, const LiveOptions& options,
                       LatencyLog& latency, Pending& pending)
    : session_(session),
      pipeline_(pipeline),
      options_(options),
      latency_(latency),
      pending_(pending),
      gaps_(pending.empty() ? 0 : pending.front()->gaps) {
  if (!pending.empty()) pending.front()->frame.after_gap = true;
}

bool LiveEngine::fetch(milliseconds patience) {
  std::optional<CapturedPtr> captured = session_.to_engine.take(patience);
  if (captured) pending_.push_back(std::move(*captured));
  return captured.has_value();
}

/// Starts the oldest frame that is not in flight; false where every slot is taken.
bool LiveEngine::submit() {
  Captured& next = *pending_[in_flight_];
  // Any of several frames of which only the last got here may have come after a gap.
  if (next.gaps != gaps_) next.frame.after_gap = true;
  next.leased = next.frame.leased != nullptr;
  if (session_.track_anew.exchange(false)) pipeline_.restart_motion();
  if (!pipeline_.submit(next.frame)) return false;
  gaps_ = next.gaps;
  ++in_flight_;
  return true;
}

void LiveEngine::deliver(Result result) {
  const TraceSpan span("deliver");
  CapturedPtr item = std::move(pending_.front());
  pending_.pop_front();
  --in_flight_;
  const Frame& frame = item->frame;
  const FrameTimes times(frame, monotonic_ns());
  ++session_.processed;
  // A frame that is not leased was copied, or made, by its source.
  session_.copies += result.copies + (item->leased ? 0 : 1);
  if (options_.times_at_Hz > 0)
    result.touch.time_ns =
        std::llround(static_cast<double>(result.touch.sequence) / options_.times_at_Hz * 1e9);
  if (options_.recording) options_.recording->measured(result.touch, times.measured_ns);
  if (options_.presses && result.touch.picture == PictureFault::None)
    options_.presses->add(frame, result.touch);
  if (options_.on_result) options_.on_result(result.touch);
  if (options_.on_frame) options_.on_frame(frame, result);
  while (options_.show_all && !session_.ending() && !session_.to_display.wait_empty(milliseconds(50))) {
  }
  if (auto displaced = session_.to_display.put({std::move(item), std::move(result), times})) {
    latency_.add(displaced->times);
    session_.give_back(*displaced);
  }
}

void LiveEngine::run() {
  while (!session_.ending()) {
    // Several frames are in flight only where each is wanted and none is in a hurry.
    if (pending_.size() == in_flight_ && (in_flight_ == 0 || options_.show_all))
      fetch(milliseconds(in_flight_ == 0 ? 20 : 0));
    if (pending_.size() > in_flight_) {
      if (submit()) {
        if (!options_.show_all) deliver(*pipeline_.wait());
        while (std::optional<Result> finished = pipeline_.poll()) deliver(std::move(*finished));
      } else if (in_flight_ > 0) {
        deliver(*pipeline_.wait());
      } else {
        session_.frames.wait(milliseconds(1));  // every slot is held by the viewer
      }
    } else if (in_flight_ > 0) {
      deliver(*pipeline_.wait());
    } else if (session_.to_engine.finished()) {
      return;
    }
  }
}

}  // namespace palpate
