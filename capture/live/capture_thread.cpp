#include "capture/live/capture_thread.h"

#include <algorithm>
#include <thread>
#include <utility>

#include "capture/live/recorder.h"
#include "engine/base/trace.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

constexpr milliseconds kPoll{10};

}  // namespace

LiveCapture::LiveCapture(LiveSession& session, const OpenSource& open, const LiveOptions& options)
    : session_(session), open_(open), options_(options) {
  const double own_Hz = session.source()->rate_Hz();
  const double rate_Hz = options.rate_Hz > 0 ? options.rate_Hz : own_Hz > 0 ? own_Hz : kFolderRate_Hz;
  period_ = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_Hz));
}

CapturedPtr LiveCapture::empty_frame() {
  for (CapturedPtr& used : session_.frames.take_all()) {
    used->frame.give_back();  // a camera wants its buffer back, not when the frame is used again
    spare_.push_back(std::move(used));
  }
  if (spare_.empty()) return std::make_unique<Captured>();
  CapturedPtr item = std::move(spare_.back());
  spare_.pop_back();
  return item;
}

/// True while nothing is to be read.
bool LiveCapture::paused() {
  if (!session_.paused) return false;
  Transport& transport = session_.transport;
  if (options_.replay && (transport.seek_to != Transport::kNowhere || transport.steps != 0)) return false;
  std::this_thread::sleep_for(kPoll);
  due_ = Clock::now();
  return true;
}

/// The next frame, or where the person wants to be.
bool LiveCapture::fetch(Frame& frame) {
  const TraceSpan span("capture");
  const std::shared_ptr<Source> source = session_.source();
  if (!options_.replay) return source->next(frame);
  Transport& transport = session_.transport;
  int64_t to = transport.seek_to.exchange(Transport::kNowhere);
  const uint64_t before = transport.position;
  bool back = false;
  if (to == Transport::kNowhere && session_.paused) {
    const int steps = transport.steps.exchange(0);
    back = steps < 0;
    if (steps < 0 || steps > 1) to = static_cast<int64_t>(before) + steps;
  }
  const int64_t part_last = transport.part_last;
  if (to == Transport::kNowhere && !session_.paused && part_last != Transport::kNowhere &&
      static_cast<int64_t>(before) >= part_last)
    to = transport.part_first;
  if (to != Transport::kNowhere) {
    const auto last = static_cast<int64_t>(source->frame_count().value_or(1)) - 1;
    const auto index = static_cast<uint64_t>(std::clamp<int64_t>(to, 0, std::max<int64_t>(last, 0)));
    if (source->seek(index)) {
      in_this_round_ = index;
      paced_ = false;
    }
  }
  if (!source->next(frame)) return false;
  // In place of a damaged frame comes the one after it: a step back goes on to the one before.
  while (back && to > 0 && source->place().value_or(0) >= before && source->seek(static_cast<uint64_t>(--to)))
    if (!source->next(frame)) return false;
  in_this_round_ = source->place().value_or(in_this_round_);
  transport.position = in_this_round_;
  transport.at_end = false;
  return true;
}

/// Handles the end of the source; true: more frames can come.
bool LiveCapture::at_end() {
  if (options_.loop && in_this_round_ > 0) {
    session_.use(open_());
    loop_offset_ns_ += last_time_ns_ + nanoseconds(period_).count();
    in_this_round_ = 0;
    paced_ = false;
    // A player shows the frames by the recording's own numbers and times, which jump back, as by a key.
    gap_pending_ = gap_pending_ || options_.replay;
    return true;
  }
  if (!options_.replay || options_.close_at_end) return false;
  // A player waits at the end for the person to go back.
  Transport& transport = session_.transport;
  transport.at_end = true;
  while (!session_.stop && transport.seek_to == Transport::kNowhere && transport.steps >= 0) {
    transport.steps = std::min<int>(transport.steps, 0);
    std::this_thread::sleep_for(kPoll);
  }
  return true;
}

/// A recording's frames come when they came, or at the rate that was asked for; a camera's are here already.
void LiveCapture::wait_until_due(const Frame& frame) {
  const bool live = session_.source()->live();
  if (!live && !options_.unpaced) {
    Clock::duration step = period_;
    const int64_t since_ns = frame.time_ns - last_time_ns_;
    if (options_.rate_Hz <= 0 && paced_ && since_ns > 0) step = nanoseconds(since_ns);
    if (options_.replay)
      step = std::chrono::duration_cast<Clock::duration>(step / session_.transport.speed.load());
    if (paced_) due_ += step;
    due_ = std::max(due_, Clock::now() - period_);  // no catching up with a slow source
    // In short sleeps: a gap in the recording must not keep the person from leaving.
    while (!session_.stop && !session_.paused && Clock::now() < due_ &&
           session_.transport.seek_to == Transport::kNowhere)
      std::this_thread::sleep_until(std::min(due_, Clock::now() + milliseconds(50)));
  }
  paced_ = true;
  last_time_ns_ = frame.time_ns;
}

void LiveCapture::deliver(CapturedPtr item) {
  const TraceSpan span("deliver");
  Frame& frame = item->frame;
  if (!session_.source()->live()) frame.delivered_ns = monotonic_ns();
  if (options_.loop && !options_.replay) {
    frame.time_ns += loop_offset_ns_;
    frame.sequence = sequence_;
  }
  ++sequence_;
  frame.after_gap = frame.after_gap || std::exchange(gap_pending_, false);
  ++session_.captured;
  if (options_.recording && !options_.recording->record(frame)) {
    // Every measured frame must be in the session, so that it can be measured again.
    gap_pending_ = frame.after_gap;
    ++session_.passed_over;
    frame.give_back();
    spare_.push_back(std::move(item));
    return;
  }
  if (frame.after_gap) ++gaps_;
  item->gaps = gaps_;
  if (options_.measure_all || options_.replay) {
    while (!session_.stop && !session_.to_engine.wait_empty(milliseconds(50))) {
    }
  }
  if (auto displaced = session_.to_engine.put(std::move(item))) {
    (*displaced)->frame.give_back();
    spare_.push_back(std::move(*displaced));
  }
}

void LiveCapture::run() {
  while (!session_.stop) {
    if (paused()) continue;
    CapturedPtr item = empty_frame();
    item->frame.after_gap = false;
    item->frame.exposed_ns = item->frame.delivered_ns = 0;
    if (!fetch(item->frame)) {
      spare_.push_back(std::move(item));
      if (session_.stop || session_.failed() || !at_end()) break;
      continue;
    }
    if (item->frame.sequence >= options_.end) break;
    item->position = in_this_round_++;
    wait_until_due(item->frame);
    deliver(std::move(item));
    if (session_.captured == options_.max_frames) break;
  }
}

}  // namespace palpate
