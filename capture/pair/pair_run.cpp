#include "capture/pair/pair_run.h"

#include <algorithm>
#include <condition_variable>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "capture/live/session.h"
#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;

/// How far one recording may be ahead of the other.
constexpr int64_t kMostAhead_ns = 500'000'000;

/// Times of one side's frames on the clock of both.
class FrameTime {
 public:
  int64_t of(const Frame& frame, bool live) {
    // The driver's stamp is not believed in every frame: the others are as far from it as the last one was.
    if (frame.exposed_ns != 0)
      offset_ns_ = frame.exposed_ns - frame.time_ns;
    else if (!offset_ns_)
      offset_ns_ = live ? frame.delivered_ns - frame.time_ns : 0;
    return frame.time_ns + *offset_ns_;
  }

 private:
  std::optional<int64_t> offset_ns_;
};

/// The one device of all: opened anew when all have let go of it.
class SharedDevice {
 public:
  /// `opened`: called while nobody uses it.
  SharedDevice(gpu::Context& context, const PairOptions& options, std::function<void()> opened)
      : context_(&context), options_(options), on_open_(std::move(opened)), users_(options.viewer ? 3 : 2) {}

  gpu::Context& reopen() {
    std::unique_lock lock(mutex_);
    const uint64_t before = opened_;
    ++waiting_;
    if (waiting_ == users_) open();
    changed_.wait(lock, [&] { return opened_ != before; });
    if (error_) std::rethrow_exception(error_);
    return *context_;
  }
  /// One of them has ended.
  void leave() {
    const std::lock_guard lock(mutex_);
    --users_;
    if (users_ > 0 && waiting_ == users_) open();
  }

 private:
  void open() {
    try {
      if (options_.reopen_device)
        context_ = &options_.reopen_device(*context_);
      else
        context_->reopen();
    } catch (...) {
      error_ = std::current_exception();
    }
    on_open_();
    waiting_ = 0;
    ++opened_;
    changed_.notify_all();
  }

  gpu::Context* context_;
  const PairOptions& options_;
  std::function<void()> on_open_;
  std::mutex mutex_;
  std::condition_variable changed_;
  int users_, waiting_ = 0;
  uint64_t opened_ = 0;
  std::exception_ptr error_;
};

/// Stands in for a finger on the caller's thread, which shows it.
class ShownFinger : public LiveViewer {
 public:
  ShownFinger(LiveSession& session, LatencyLog& latency, const LiveOptions& options,
              const std::atomic<bool>& losing)
      : finger_{session, latency, options}, losing_(losing) {}

  // The finger's own thread.
  LiveReport run() override {
    std::optional<int64_t> start_ns;
    bool interrupted = false;
    const LiveSession& session = finger_.session;
    while (!session.ending() && !interrupted) {
      std::this_thread::sleep_for(milliseconds(5));
      if (session.to_display.finished() && (finger_.options.close_at_end || losing_ || session.failed()))
        break;
      if (!start_ns && session.processed > 0) start_ns = monotonic_ns();
      if (finger_.options.max_seconds > 0 && start_ns &&
          1e-9 * static_cast<double>(monotonic_ns() - *start_ns) >= finger_.options.max_seconds)
        break;
      interrupted = finger_.options.interrupted && finger_.options.interrupted();
    }
    std::unique_lock lock(mutex_);
    leaving_ = true;
    left_.wait(lock, [this] { return gone_; });
    report_.interrupted = interrupted;
    return report_;
  }

  // The caller's thread.
  RunningFinger& finger() { return finger_; }
  bool leaving() const {
    const std::lock_guard lock(mutex_);
    return leaving_;
  }
  void let_go(const LiveReport& shown) {
    const std::lock_guard lock(mutex_);
    report_ = shown;
    gone_ = true;
    left_.notify_all();
  }

 private:
  RunningFinger finger_;
  const std::atomic<bool>& losing_;
  mutable std::mutex mutex_;
  std::condition_variable left_;
  bool leaving_ = false, gone_ = false;
  LiveReport report_;
};

class PairRun {
 public:
  PairRun(gpu::Context& context, const std::array<PairFinger, 2>& fingers, const PairOptions& options)
      : options_(options),
        device_(context, options, [this] { forget_loss(); }),
        in_step_(std::ranges::all_of(fingers, [](const PairFinger& f) { return f.options.measure_all; })),
        window_ns_(std::llround(0.5e9 * options.period_s)),
        matcher_(window_ns_, in_step_ ? SIZE_MAX : options.most_waiting) {
    for (const Side side : kSides) {
      const PairFinger& finger = fingers[index(side)];
      sides_[index(side)].session.emplace(Patience(finger.options.patience_s, finger.options.input));
    }
    for (const Side side : kSides)
      sides_[index(side)].thread =
          std::thread([this, side, &context, &finger = fingers[index(side)]] { run(side, context, finger); });
  }
  ~PairRun() {
    stop_ = true;
    join();
  }
  PairRun(const PairRun&) = delete;
  PairRun& operator=(const PairRun&) = delete;

  PairReport wait() {
    while (!ended(Side::Left) || !ended(Side::Right)) {
      if (options_.viewer)
        show();
      else
        std::this_thread::sleep_for(milliseconds(10));
      if (options_.interrupted && options_.interrupted()) stop_ = true;
      if (options_.on_progress)
        options_.on_progress(sides_[0].session->captured + sides_[1].session->captured);
      for (const Side side : kSides) tell_state(side);
      tell_loss();
    }
    join();
    if (viewer_error_) std::rethrow_exception(viewer_error_);
    for (const Finger& finger : sides_)
      if (finger.error) std::rethrow_exception(finger.error);
    PairReport report{.fingers = {sides_[0].report, sides_[1].report},
                      .skew = matcher_.skew(),
                      .alone = {matcher_.alone(Side::Left), matcher_.alone(Side::Right)},
                      .interrupted = stop_ && !closed_};
    for (LiveReport& finger : report.fingers) finger.interrupted &= report.interrupted;
    return report;
  }

 private:
  struct Finger {
    std::optional<LiveSession> session;
    std::thread thread;
    LiveReport report;
    std::exception_ptr error;
    // Of the caller's thread:
    std::string state;  ///< as told last
    bool over = false;  ///< all that it measured is with its viewer
    FrameTime time;     // of its engine's thread
    // Under the pair's lock:
    int64_t newest_ns = INT64_MIN;
    bool turning = false;  ///< its time jumps back, and it waits for the other to get to where it was
    uint64_t turns = 0;    ///< that are over
    bool ended = false;
    ShownFinger* shown = nullptr;  ///< while its results are shown
  };

  bool ended(Side side) {
    const std::lock_guard lock(mutex_);
    return sides_[index(side)].ended;
  }
  void join() {
    for (Finger& finger : sides_)
      if (finger.thread.joinable()) finger.thread.join();
  }

  /// A finger's own thread.
  void run(Side side, gpu::Context& context, const PairFinger& given) {
    Finger& finger = sides_[index(side)];
    name_trace_thread(to_string(side));
    LiveOptions options = given.options;
    options.interrupted = [this] { return stop_.load(); };
    options.on_frame = [this, side](const Frame& frame, const Result& result) {
      take(side, frame, result.touch);
    };
    options.measured_on_device = [this] {
      return sides_[0].session->processed + sides_[1].session->processed;
    };
    options.on_device_lost = [this, side](const DeviceLost& lost) { tell_other(side, lost); };
    options.reopen_device = [this](gpu::Context&) -> gpu::Context& { return device_.reopen(); };
    try {
      MakeViewer viewer = given.viewer;
      if (options_.viewer)
        viewer = [&](LiveSession& session, LatencyLog& latency, const Pipeline&) {
          return make_shown(finger, session, latency, options);
        };
      finger.report = viewer ? run_session(*finger.session, context, given.open, given.run, options, viewer)
                             : run_without_window(*finger.session, context, given.open, given.run, options);
    } catch (...) {
      finger.error = std::current_exception();
    }
    device_.leave();
    const std::lock_guard lock(mutex_);
    finger.ended = true;
    moved_.notify_all();
    give(matcher_.leave(side));
  }

  std::unique_ptr<LiveViewer> make_shown(Finger& finger, LiveSession& session, LatencyLog& latency,
                                         const LiveOptions& options) {
    auto shown = std::make_unique<ShownFinger>(session, latency, options, losing_);
    const std::lock_guard lock(mutex_);
    finger.shown = shown.get();
    return shown;
  }

  // The caller's thread. A finger waits for it to let go before its results are gone.
  std::array<RunningFinger*, 2> running() {
    const std::lock_guard lock(mutex_);
    std::array<RunningFinger*, 2> fingers{};
    for (const Side side : kSides)
      if (ShownFinger* shown = sides_[index(side)].shown) fingers[index(side)] = &shown->finger();
    return fingers;
  }
  void let_go(Side side) {
    ShownFinger* shown = nullptr;
    {
      const std::lock_guard lock(mutex_);
      shown = std::exchange(sides_[index(side)].shown, nullptr);
    }
    if (shown) shown->let_go(options_.viewer->let_go(side, shown->finger()));
  }
  void let_go_of_leaving() {
    for (const Side side : kSides) {
      bool leaving = false;
      {
        const std::lock_guard lock(mutex_);
        const ShownFinger* shown = sides_[index(side)].shown;
        leaving = shown && shown->leaving();
      }
      if (leaving || closed_) let_go(side);
    }
  }
  void show() {
    let_go_of_leaving();
    if (closed_ || (viewer_lost_ && !losing_)) {
      std::this_thread::sleep_for(milliseconds(5));
      return;
    }
    try {
      if (losing_) {
        for (const Side side : kSides) let_go(side);
        options_.viewer->detach();
        device_.reopen();
        options_.viewer->attach();
        viewer_lost_ = false;
      } else if (!options_.viewer->show(running())) {
        close();
      }
    } catch (const DeviceLost& error) {
      viewer_lost_ = true;
      bool told = false;
      for (const Side side : kSides) told |= lose(side, error);
      if (!told) fail_viewer();
    } catch (...) {
      fail_viewer();
    }
  }
  void fail_viewer() {
    viewer_error_ = std::current_exception();
    close();
  }
  void close() {
    if (std::exchange(closed_, true)) return;
    for (const Side side : kSides) let_go(side);
    options_.viewer->detach();  // the device may be lost at this moment
    stop_ = true;
    device_.leave();
  }

  /// Under the lock, so that one call comes at a time.
  void give(const PairMatcher<FingerTouch>::Out& all) {
    if (!options_.on_pair) return;
    for (const Matched<FingerTouch>& one : all) options_.on_pair(one);
  }

  /// The engine's thread of a finger.
  void take(Side side, const Frame& frame, const Touch& touch) {
    Finger &here = sides_[index(side)], &there = sides_[index(other(side))];
    const int64_t time_ns = here.time.of(frame, here.session->source()->live());
    std::unique_lock lock(mutex_);
    if (in_step_ && time_ns < here.newest_ns) let_catch_up(side, lock);
    here.newest_ns = time_ns;
    moved_.notify_all();
    give(matcher_.add(side, time_ns,
                      {touch, time_ns, frame.exposed_ns != 0 ? frame.exposed_ns : frame.delivered_ns}));
    // Two recordings keep step, so that what makes a pair does not depend on which is read faster.
    const auto may_go = [&] {
      return there.ended || there.session->to_display.finished() || here.session->ending() || stop_ ||
             there.newest_ns > time_ns - kMostAhead_ns ||
             (there.newest_ns == INT64_MIN && time_ns < kMostAhead_ns);
    };
    while (in_step_ && !may_go()) moved_.wait_for(lock, milliseconds(20));
  }

  /// False: that finger needs no device any more.
  bool lose(Side side, const DeviceLost& lost) {
    LiveSession& session = *sides_[index(side)].session;
    if (ended(side) || session.to_engine.finished()) return false;
    session.lose_device(lost);
    return true;
  }
  /// A recording whose time jumps back: its frames so far get their partners first, however fast the other
  /// is read.
  void let_catch_up(Side side, std::unique_lock<std::mutex>& lock) {
    Finger &here = sides_[index(side)], &there = sides_[index(other(side))];
    const int64_t until_ns = here.newest_ns + window_ns_;
    const uint64_t turns = there.turns;
    here.turning = true;
    moved_.notify_all();
    while (!there.ended && !there.session->to_display.finished() && !there.turning && there.turns == turns &&
           there.newest_ns < until_ns && !here.session->ending() && !stop_)
      moved_.wait_for(lock, milliseconds(20));
    here.turning = false;
    ++here.turns;
    moved_.notify_all();
  }

  /// The first finger that finds the device lost makes the other let go of it too.
  void tell_other(Side side, const DeviceLost& lost) {
    if (losing_.exchange(true)) return;
    lose(other(side), lost);
    const std::lock_guard lock(mutex_);
    loss_ = lost;
  }
  /// What a finger was told of the device before is not true of the one that was opened.
  void forget_loss() {
    for (Finger& finger : sides_) finger.session->take_device_error();
    losing_ = false;
  }

  // The caller's thread.
  void tell_loss() {
    std::optional<DeviceLost> loss;
    {
      const std::lock_guard lock(mutex_);
      loss.swap(loss_);
    }
    if (loss && options_.on_device_lost) options_.on_device_lost(*loss);
  }
  void tell_state(Side side) {
    Finger& finger = sides_[index(side)];
    std::string state = finger.state;  // one that has ended in good order brings no frames again
    if (ended(side)) {
      try {
        if (finger.error) std::rethrow_exception(finger.error);
      } catch (const std::exception& error) {
        state = error.what();
      }
    } else if (const std::shared_ptr<Source> source = finger.session->source()) {
      state = source->state();
    }
    // A viewer may keep the last results while the other finger goes on.
    const bool over = finger.session->to_display.finished();
    if (over != finger.over || (state != finger.state && !state.empty())) {
      const std::lock_guard lock(mutex_);
      give(matcher_.leave(side));
    }
    finger.over = over;
    if (state == finger.state) return;
    finger.state = state;
    if (options_.on_state) options_.on_state(side, state);
  }

  const PairOptions& options_;
  SharedDevice device_;
  const bool in_step_;
  const int64_t window_ns_;
  std::atomic<bool> stop_{false};
  bool closed_ = false;       ///< nothing is shown any more
  bool viewer_lost_ = false;  ///< its device; the fingers that were told open it anew
  std::exception_ptr viewer_error_;
  std::atomic<bool> losing_{false};
  std::mutex mutex_;
  std::condition_variable moved_;
  PairMatcher<FingerTouch> matcher_;
  std::optional<DeviceLost> loss_;
  std::array<Finger, 2> sides_;
};

}  // namespace

PairReport run_pair(gpu::Context& context, const std::array<PairFinger, 2>& fingers,
                    const PairOptions& options) {
  return PairRun(context, fingers, options).wait();
}

}  // namespace palpate
