#include "viz/python/pair_stream.h"

#include <algorithm>

#include "capture/pair/pair_run.h"
#include "palpate/error.h"
#include "viz/python/device.h"
#include "viz/python/waiting.h"

namespace palpate::python {
namespace {

using std::chrono::milliseconds;

/// Frames of a finger that wait for their row or for the reader.
constexpr size_t kHeld = 4;
/// With those one at the reader's, one that waits for that place, one in flight.
constexpr uint32_t kSlots = kHeld + 3;
constexpr milliseconds kShort{20};

uint64_t dropped_of(const LiveSession& session) {
  return session.to_engine.displaced() + session.to_display.displaced() + session.passed_over +
         session.source()->counts().lost;
}

std::optional<uint64_t> number_of(const GripFrame& row, Side side) {
  return side == Side::Left ? row.left : row.right;
}

}  // namespace

/// Gives what is measured of one finger on one device; what the reader has of it expires with that device.
class PairStream::Viewer : public LiveViewer {
 public:
  Viewer(PairStream& stream, Side side, LiveSession& session, const Pipeline& pipeline)
      : stream_(stream), side_(side), session_(session), pipeline_(pipeline) {
    {
      const std::lock_guard lock(stream_.mutex_);
      Finger& finger = stream_.fingers_[index(side)];
      finger.session = &session;
      finger.started = true;
    }
    stream_.changed_.notify_all();
  }
  ~Viewer() override { stream_.leave(side_); }
  LiveReport run() override {
    stream_.hand_over(side_, session_, pipeline_);
    return {};
  }

 private:
  PairStream& stream_;
  Side side_;
  LiveSession& session_;
  const Pipeline& pipeline_;
};

PairStream::PairStream(const PairStreamRequest& request, const std::atomic<bool>& stop)
    : request_(request), trace_(request.trace), watch_(watch_of(closed_)) {
  if (!request_.out.empty() && std::filesystem::exists(request_.out / kPairJson))
    throw Error(Failure::Output, "a folder without a session to record to",
                "'" + (request_.out / kPairJson).string() + "'", "another folder");
  device_ = shared_device(request.device);
  const RunWatch opening = watch_of(stop);  // until the fingers' sessions watch their sources
  pair_.emplace(request_.recorded.empty() ? open_pair(request_, opening)
                                          : open_recorded_pair(request_.recorded, opening));
  drops_ = request_.drop;
  meter_.emplace(pair_->grip);
  for (const Side side : kSides) {
    OpenFinger& finger = pair_->fingers[index(side)];
    finger.pipeline.slots = kSlots;
    has_truth_[index(side)] = finger.source->truth(0).has_value();
    if (finger.source->rate_Hz() > 0)
      finger.live.rate_Hz = 0;  // it has times of its own
    else
      finger.live.times_at_Hz = finger.live.rate_Hz;
    finger.live.measure_all = finger.live.show_all = finger.live.unpaced = !drops_;
    finger.live.outlive_device = drops_;  // else frames would be missing
  }
  if (!request_.out.empty()) {
    recording_.emplace([this] { return request_.out; }, pair_->fingers, *device_, pair_->grip, !drops_,
                       watch_);
    recording_->take(open_logs(request_.fingers[0].logs));
    recording_->start();
    for (const Side side : kSides) pair_->fingers[index(side)].live.recording = &recording_->of(side);
  }
  thread_ = std::thread([this] { run(); });
  std::unique_lock lock(mutex_);
  const auto begun = [](const Finger& finger) { return finger.started || !finger.state.empty(); };
  changed_.wait(lock, [&] { return finished_ || std::ranges::all_of(fingers_, begun); });
  if (!finished_ || !failure_) return;
  const std::exception_ptr failure = failure_;
  lock.unlock();
  close();
  std::rethrow_exception(failure);
}

PairStream::~PairStream() {
  close();
}

void PairStream::close() {
  const std::lock_guard closing(closing_);
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
  released_.notify_all();
  if (thread_.joinable()) thread_.join();
  trace_.close();
}

bool PairStream::live() const {
  return std::ranges::any_of(pair_->fingers, [](const OpenFinger& f) { return f.source->live(); });
}

uint64_t PairStream::dropped() const {
  const std::lock_guard lock(mutex_);
  uint64_t all = passed_over_;
  for (const Finger& finger : fingers_) all += finger.session ? dropped_of(*finger.session) : finger.dropped;
  return all;
}

std::string PairStream::state() const {
  const std::lock_guard lock(mutex_);
  std::string all;
  for (const Side side : kSides)
    if (const std::string& one = fingers_[index(side)].state; !one.empty())
      all += (all.empty() ? "" : "; ") + std::string(to_string(side)) + ": " + one;
  return all;
}

std::string PairStream::device_name() const {
  const std::lock_guard lock(mutex_);
  return device_->report().name;
}

std::optional<PairRecording::Written> PairStream::recorded() const {
  return recording_ ? std::optional(recording_->latest()) : std::nullopt;
}

bool PairStream::ending() const {
  return closed_ || (recording_ && !recording_->latest().error().empty());
}

PairFinger PairStream::finger(Side side) {
  PairFinger finger = pair_->fingers[index(side)].pair();
  finger.viewer = [this, side](LiveSession& session, LatencyLog&, const Pipeline& pipeline) {
    return std::make_unique<Viewer>(*this, side, session, pipeline);
  };
  return finger;
}

/// Both fingers, on a thread of its own; the reader gets its error after the rows before it.
void PairStream::run() {
  name_trace_thread("stream");
  PairOptions options;
  options.period_s = pair_->info.period_s;
  options.most_waiting = kHeld - 1;  // a frame that waits longer is not at hand any more
  options.on_pair = [this](const Matched<FingerTouch>& pair) { add_row(pair); };
  options.on_state = [this](Side side, const std::string& state) {
    {
      const std::lock_guard lock(mutex_);
      fingers_[index(side)].state = state;
    }
    changed_.notify_all();
  };
  options.interrupted = [this] { return ending(); };
  options.on_device_lost = [this](const DeviceLost&) { ++device_losses_; };
  options.reopen_device = [this](gpu::Context&) -> gpu::Context& { return reopen_device(); };
  try {
    run_pair(*device_, {finger(Side::Left), finger(Side::Right)}, options);
    for (const Side side : kSides)
      if (const Source& source = *pair_->fingers[index(side)].source; !closed_ && source.cut_short())
        throw Error(Failure::Input, "a whole recording in '" + input(side).input + "'",
                    "fewer frames: the file is damaged or cut short", "copying it again");
    if (recording_) recording_->finish();
    if (const auto written = recorded(); written && !written->error().empty())
      throw Error(Failure::Output, "a session in '" + request_.out.string() + "'", written->error(),
                  "another folder");
  } catch (const DeviceLost&) {
    forget_device(*device_);
    fail();
  } catch (...) {
    fail();
  }
  finish();
}

gpu::Context& PairStream::reopen_device() {
  forget_device(*device_);
  std::shared_ptr<gpu::Context> anew = shared_device(request_.device);
  const std::lock_guard lock(mutex_);
  device_ = std::move(anew);
  return *device_;
}

void PairStream::expire(HeldPair& pair) {
  for (const Side side : kSides)
    if (LiveSession* session = fingers_[index(side)].session; session && pair.of[index(side)])
      pair.of[index(side)]->expire(*session);
}

/// Whether nothing of a finger is at hand. Under mutex().
bool PairStream::wants_none(Side side) const {
  const auto has = [side](const std::shared_ptr<HeldPair>& pair) { return pair && pair->of[index(side)]; };
  return fingers_[index(side)].held.empty() && !has(given_) && std::ranges::none_of(results_, has);
}

/// A finger's own thread.
void PairStream::hand_over(Side side, LiveSession& session, const Pipeline& pipeline) {
  Finger& finger = fingers_[index(side)];
  const std::shared_ptr<const Source> source = session.source();
  while (!session.ending() && !ending()) {
    {
      std::unique_lock lock(mutex_);
      const bool over = session.to_display.finished();
      // The last row can be read until the next one is asked for.
      if (over && wants_none(side)) return;
      if (over || (!drops_ && finger.held.size() + results_.size() >= kHeld)) {
        released_.wait_for(lock, kShort);
        continue;
      }
    }
    auto measured = session.to_display.take(kShort);
    if (!measured) continue;
    const TraceSpan span("offer");
    std::string file = source->frame_name(measured->result.touch.sequence);
    auto held = std::make_shared<HeldFrame>(pipeline, std::move(*measured),
                                            has_truth_[index(side)] ? source : nullptr, std::move(file));
    {
      const std::lock_guard lock(mutex_);
      finger.held.push_back(std::move(held));
      if (finger.held.size() > kHeld) {
        finger.held.front()->expire(session);
        finger.held.pop_front();
      }
      match_rows();
    }
    changed_.notify_all();
  }
}

void PairStream::add_row(const Matched<FingerTouch>& pair) {
  if (recording_) recording_->add(pair);
  {
    const std::lock_guard lock(mutex_);
    rows_.push_back(meter_->add(pair));
    match_rows();
  }
  changed_.notify_all();
}

/// Hands on the rows whose frames are at hand. Under mutex().
void PairStream::match_rows() {
  while (!rows_.empty()) {
    bool missed = false;
    HeldPair pair{rows_.front(), {}};
    if (!take_frames(pair, missed)) return;
    rows_.pop_front();
    if (missed) {
      expire(pair);
      ++passed_over_;
    } else if (drops_) {
      offer_newest(std::make_shared<HeldPair>(std::move(pair)));
    } else {
      results_.push_back(std::make_shared<HeldPair>(std::move(pair)));
    }
  }
}

/// False: a frame of the row may still come; nothing was taken. `missed`: one was displaced by a newer one.
bool PairStream::take_frames(HeldPair& pair, bool& missed) {
  for (const Side side : kSides) {
    const auto& held = fingers_[index(side)].held;
    if (const auto number = number_of(pair.row, side))
      if (held.empty() || held.back()->touch().sequence < *number) return false;
  }
  for (const Side side : kSides) {
    const auto number = number_of(pair.row, side);
    auto& held = fingers_[index(side)].held;
    while (number && held.front()->touch().sequence < *number) {
      held.front()->expire(*fingers_[index(side)].session);
      held.pop_front();
    }
    if (!number) continue;
    if (held.front()->touch().sequence > *number) {
      missed = true;
      continue;
    }
    pair.of[index(side)] = std::move(held.front());
    held.pop_front();
  }
  return true;
}

/// A finger's session or device is over.
void PairStream::leave(Side side) {
  const std::lock_guard lock(mutex_);
  Finger& finger = fingers_[index(side)];
  for (const std::shared_ptr<HeldFrame>& held : finger.held) held->expire(*finger.session);
  finger.held.clear();
  const auto has = [side](const std::shared_ptr<HeldPair>& pair) { return bool(pair->of[index(side)]); };
  for (const std::shared_ptr<HeldPair>& pair : results_)
    if (has(pair)) expire(*pair);
  passed_over_ += std::erase_if(results_, has);
  if (given_ && given_->of[index(side)]) given_->of[index(side)]->expire(*finger.session);
  finger.dropped = dropped_of(*finger.session);
  finger.session = nullptr;
}

}  // namespace palpate::python
