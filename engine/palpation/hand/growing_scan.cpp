#include "engine/palpation/hand/growing_scan.h"

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <map>
#include <mutex>
#include <stop_token>
#include <thread>
#include <utility>

#include "engine/base/give_way.h"
#include "engine/base/stop.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

/// Pixels of its own: a camera wants its buffer back.
Frame copy_of(const Frame& frame) {
  Frame own;
  own.reshape(frame.format);
  std::copy_n(frame.pixels(), own.bytes.size(), own.bytes.begin());
  return own;
}

bool same(const PressReading& a, const PressReading& b) {
  return a.block_mm == b.block_mm && a.young_Pa == b.young_Pa && a.loads == b.loads &&
         a.pitch_mm == b.pitch_mm;
}

}  // namespace

struct GrowingScan::Work {
  /// Frames of one press.
  struct Kept {
    uint64_t number = 0;  ///< from 1
    std::vector<double> force_N;
    std::vector<Frame> frames;

    double highest_N() const { return *std::ranges::max_element(force_N); }
  };
  using KeptPress = std::shared_ptr<const Kept>;

  Work(const Sensor& s, const Frame& b) : sensor(s), background(copy_of(b)) {}

  void run(const std::stop_token& stop);
  std::shared_ptr<const SeenScan> put_together(const std::vector<KeptPress>& presses, const PressReading& as,
                                               const StopAsked& stop);
  HandRecording read(const std::vector<KeptPress>& presses, const PressReading& as, const StopAsked& stop);

  const Sensor sensor;
  const Frame background;
  std::atomic<bool> on = false, restarted = false;

  // Of the thread that brings frames; of a long press every so many frames are kept.
  std::shared_ptr<Kept> now;  ///< null: no press that is taken
  PressReading reading;       ///< of the last press; written under the mutex
  uint64_t stride = 1, taken = 0;

  // State of the thread that reads: presses at the force that all had in common.
  std::map<uint64_t, std::pair<PressPlan, ReadPress>> known;
  double known_N = 0;

  mutable std::mutex mutex;  ///< of what follows
  std::condition_variable_any changed;
  std::vector<KeptPress> presses;
  size_t bytes = 0;
  uint64_t numbers = 0;
  std::atomic<uint64_t> round = 0;
  bool waiting = false, busy = false, full = false;
  std::string broken;
  std::shared_ptr<const SeenScan> seen;

  std::jthread thread;  ///< last: it uses the rest
};

/// A press is read once, and all once more where a weaker one has lowered the force.
HandRecording GrowingScan::Work::read(const std::vector<KeptPress>& all, const PressReading& as,
                                      const StopAsked& stop) {
  check_hand(sensor, background.format, as);
  std::vector<double> highest_N;
  highest_N.reserve(all.size());
  for (const KeptPress& press : all) highest_N.push_back(press->highest_N());
  const double top_N = common_force_N(highest_N);
  if (top_N != known_N || (!known.empty() && known.begin()->first != all[0]->number)) known.clear();
  known_N = top_N;
  const PressReader reader(sensor, background, as);
  HandRecording out;
  for (size_t p = 0; p < all.size(); ++p) {
    const KeptPress& press = all[p];
    auto found = known.find(press->number);
    if (found == known.end()) {
      PressPlan plan = plan_press("press " + std::to_string(p + 1), press->force_N, top_N, as.loads);
      ReadPress as_read;
      if (plan.trouble.empty())
        as_read = reader.read(plan, [&](size_t i) -> const Frame& {
          check_stop(stop);
          return press->frames[i];
        });
      found = known.emplace(press->number, std::pair(std::move(plan), std::move(as_read))).first;
    }
    take_press(out, found->second.first, found->second.second);
  }
  return out;
}

/// Null where it was stopped.
std::shared_ptr<const SeenScan> GrowingScan::Work::put_together(const std::vector<KeptPress>& all,
                                                                const PressReading& as,
                                                                const StopAsked& stop) {
  auto out = std::make_shared<SeenScan>();
  out->reading = as;
  out->presses = all.size();
  try {
    const HandRecording recording = read(all, as, stop);
    HandScanOptions options;
    options.places.stop = stop;
    static const lump::Estimator estimator = lump::named_estimator("refined", lump::load_network(""), {});
    if (recording.presses.size() < 2)
      out->trouble = "not enough presses: two that overlap by half are needed";
    else
      out->answer = answer_by_hand(recording, options, estimator);
  } catch (const Error& error) {
    out->trouble = error.what();
  } catch (const Stopped&) {
    return nullptr;
  }
  return out;
}

void GrowingScan::Work::run(const std::stop_token& stop) {
  give_way();
  std::unique_lock lock(mutex);
  while (changed.wait(lock, stop, [this] { return waiting; }) && !stop.stop_requested()) {
    const std::vector<KeptPress> all = presses;
    const PressReading as = reading;
    const uint64_t of = round;
    waiting = false;
    busy = true;
    lock.unlock();
    std::shared_ptr<const SeenScan> found =
        put_together(all, as, [&] { return stop.stop_requested() || of != round; });
    lock.lock();
    busy = false;
    if (found && of == round) seen = std::move(found);
    changed.notify_all();
  }
}

GrowingScan::GrowingScan(const Sensor& sensor, const Frame& background)
    : work_(std::make_unique<Work>(sensor, background)) {}
GrowingScan::~GrowingScan() = default;

void GrowingScan::switch_on(bool on) {
  work_->on = on;
}

void GrowingScan::restart() {
  Work& w = *work_;
  w.restarted = true;
  const std::lock_guard lock(w.mutex);
  w.presses.clear();
  w.bytes = 0;
  w.full = w.waiting = false;
  w.broken.clear();
  w.seen.reset();
  ++w.round;
}

void GrowingScan::begin_press() {
  Work& w = *work_;
  w.restarted = false;
  w.now.reset();
  if (!w.on) return;
  w.now = std::make_shared<Work::Kept>();
  w.stride = 1;
  w.taken = 0;
}

void GrowingScan::add(const Frame& frame, double force_N) {
  Work& w = *work_;
  if (!w.now || w.taken++ % w.stride != 0) return;
  Work::Kept& now = *w.now;
  now.force_N.push_back(force_N);
  now.frames.push_back(copy_of(frame));
  if (now.frames.size() < kMostFrames) return;
  for (size_t i = 1; 2 * i < now.frames.size(); ++i) {
    now.force_N[i] = now.force_N[2 * i];
    now.frames[i] = std::move(now.frames[2 * i]);
  }
  now.force_N.resize(kMostFrames / 2);
  now.frames.resize(kMostFrames / 2);
  w.stride *= 2;
}

void GrowingScan::end_press(const std::string& trouble, const PressReading& reading) {
  Work& w = *work_;
  const std::shared_ptr<Work::Kept> over = std::exchange(w.now, nullptr);
  if (!over || over->frames.empty() || w.restarted) return;
  if (!same(reading, w.reading)) restart();
  const std::lock_guard lock(w.mutex);
  w.broken = trouble;
  if (!trouble.empty()) return;
  const size_t more = over->frames.size() * over->frames[0].bytes.size();
  w.full = w.bytes + more > kMost_bytes;
  if (w.full) return;
  w.reading = reading;
  w.bytes += more;
  over->number = ++w.numbers;
  w.presses.push_back(over);
  w.waiting = true;
  if (!w.thread.joinable()) w.thread = std::jthread([&w](const std::stop_token& stop) { w.run(stop); });
  w.changed.notify_all();
}

ScanStatus GrowingScan::status() const {
  const Work& w = *work_;
  const std::lock_guard lock(w.mutex);
  return {w.on, w.waiting || w.busy, w.full, w.presses.size(), w.broken, w.seen};
}

void GrowingScan::finish() {
  Work& w = *work_;
  std::unique_lock lock(w.mutex);
  w.changed.wait(lock, [&w] { return !w.waiting && !w.busy; });
}

}  // namespace palpate
