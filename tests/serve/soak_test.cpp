// Two fingers for a day of their own time: sessions, clients and lost devices come and go; every frame and
// every message is accounted for, and neither memory nor handles grow.
#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <fstream>
#include <iostream>
#include <optional>
#include <set>
#include <thread>

#include "capture/live/recorder.h"
#include "capture/pair/pair_run.h"
#include "capture/run/input.h"
#include "capture/serve/server.h"
#include "capture/synthetic/synthetic.h"
#include "engine/base/text.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "tests/serve/live_client.h"
#include "tests/serve/slow_camera.h"
#include "tests/support/eventually.h"
#include "tests/support/session_fixture.h"
#include "tests/support/test_folder.h"
#include "tests/support/thorough.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;
using std::chrono::milliseconds;

uint64_t entries(const char* folder) {
  uint64_t count = 0;
  for (const auto& entry : fs::directory_iterator(folder)) count += entry.path().empty() ? 0 : 1;
  return count;
}

/// What the process holds.
struct Held {
  double resident_MB = 0, in_use_MB = 0;
  uint64_t files = 0, threads = 0;

  static Held now() {
    Held held;
    malloc_trim(0);
    const struct mallinfo2 memory = mallinfo2();
    held.in_use_MB = 1e-6 * static_cast<double>(memory.uordblks + memory.hblkhd);
    std::ifstream file("/proc/self/statm");
    double size = 0, resident = 0;
    file >> size >> resident;
    held.resident_MB = 1e-6 * resident * static_cast<double>(sysconf(_SC_PAGESIZE));
    held.files = entries("/proc/self/fd");
    held.threads = entries("/proc/self/task");
    return held;
  }
};

/// One finger of the run.
struct Finger {
  Sensor sensor;
  Frame background;
  std::vector<Frame> round;
  std::optional<Recording> recording;
  uint64_t shown = 0;          ///< of its own thread
  uint64_t measured = 0;       ///< of its engine's thread
  std::set<uint64_t> lost_in;  ///< parts of the run in which it lost the device; likewise
};

class NeverStops : public testing::Test {
 protected:
  static constexpr uint64_t kParts = 24;

  explicit NeverStops(uint64_t seconds = of_sweep(86400, 1200)) : seconds_(seconds) {}
  void SetUp() override {
    folder_ = test_folder("never_stops");
    for (const Side side : kSides) {
      Finger& f = of(side);
      const SyntheticOptions scene =
          parse_synthetic(std::string("synthetic:grip?size=64x48&rate=30&side=") + to_string(side));
      f.sensor = synthetic_sensor(scene);
      SyntheticSensor source(scene);
      f.background = *source.own_background();
      for (Frame frame; source.next(frame);) f.round.push_back(frame);
      make_recording(side);
    }
    serve();
  }
  void TearDown() override {
    server_.reset();
    for (Finger& finger : fingers_) finger.recording.reset();
    fs::remove_all(folder_);
  }

  Finger& of(Side side) { return fingers_[index(side)]; }
  void make_recording(Side side);
  void serve();
  PairFinger pair_finger(Side side);
  /// As the program has it: the validation layer keeps something of each pipeline.
  static gpu::Context& context() {
    static gpu::Context shared{gpu::ContextOptions{}};
    return shared;
  }
  PairReport run();
  void watch();
  void visit();
  void send_the_end(uint64_t time);
  void expect_every_frame_accounted_for(const PairReport& report);
  void expect_sessions_whole(const PairReport& report);
  void expect_every_message_accounted_for(CountingClient& reader, CountingClient& stalled);
  void expect_flat() const;
  std::string topic(Side side, const char* kind) {
    return std::string("/") + to_string(side) + "/" + topic_name(of(side).sensor.name) + "/" + kind;
  }
  std::array<std::string, 2> touches() { return {topic(Side::Left, "touch"), topic(Side::Right, "touch")}; }
  uint64_t passed(const std::string& name) const {
    for (size_t i = 0; i < hub_->topics().size(); ++i)
      if (hub_->topics()[i].name == name) return hub_->passed(i);
    throw std::out_of_range(name);
  }

  const uint64_t seconds_;
  fs::path folder_;
  std::array<Finger, 2> fingers_;
  SimulatedTime time_;
  std::optional<LiveHub> hub_;
  std::optional<LiveServer> server_;
  uint64_t sessions_ = 0, pairs_ = 0, visits_ = 0, visitors_took_ = 0;
  std::array<uint64_t, 2> alone_{};
  std::vector<Held> held_;                         ///< at the end of each part
  std::array<uint64_t, kParts + 1> most_files_{};  ///< in each part
};

void NeverStops::make_recording(Side side) {
  Finger& f = of(side);
  SessionInfo info;
  info.input = "a simulated day";
  info.sensor = f.sensor;
  info.format = f.background.format;
  info.rate_Hz = 1;
  info.background = f.background;
  info.outputs = Output::Force;
  const auto folder = [this, side] {
    return side == Side::Right ? folder_ / "right" : folder_ / ("left" + std::to_string(sessions_++));
  };
  f.recording.emplace(folder, info, SessionOptions{});
  f.recording->start();
}

void NeverStops::serve() {
  std::vector<LiveHub::Publisher> publishers;
  for (const Side side : kSides)
    publishers.push_back({of(side).sensor, Output::Force, MeasuredColumns::of(of(side).sensor, Output::Force),
                          to_string(side)});
  hub_.emplace(std::move(publishers));
  ServeOptions options;
  options.port = 0;
  options.stall_s = 1e6;
  server_.emplace(*hub_, options, std::vector<ServedRequest>{{"/zero", "palpate.Zero", "{}"}});
}

PairFinger NeverStops::pair_finger(Side side) {
  Finger& f = of(side);
  LiveOptions options;
  options.input = std::string("a simulated camera, ") + to_string(side);
  options.recording = &*f.recording;
  options.on_result = [this, side, &f](const Touch& touch) {
    ++f.measured;
    time_.measured(side, touch.sequence);
    time_.sit_out_hurry(side, touch.sequence, seconds_);
    // Once in each part, by turns, the device is gone.
    const uint64_t part = touch.sequence * kParts / seconds_;
    const bool turn = part % 2 == index(side) && touch.sequence > (2 * part + 1) * seconds_ / (2 * kParts);
    if (turn && f.lost_in.insert(part).second) throw DeviceLost("a device", "none", "the test");
  };
  options.on_newest = [this, side, &f](const Frame& frame, const Result& result) {
    hub_->publish(index(side), frame, result, result.touch);
    if (f.shown++ % 10 == 0) hub_->publish_event(index(side), {result.touch.sequence, 0, "mark", "soak"});
  };
  return {[this, side, &f] { return std::make_shared<SlowCamera>(side, f.round, time_, seconds_); },
          {f.sensor, f.background, {.outputs = Output::Force}},
          options};
}

/// The caller's thread of the run: a new session of the left finger in each part, and what the process holds.
void NeverStops::watch() {
  const uint64_t part = std::min(time_.now_s() * kParts / seconds_, kParts);
  most_files_[part] = std::max(most_files_[part], entries("/proc/self/fd"));
  if (part <= held_.size()) return;
  held_.resize(part, Held::now());
  time_.hold([this] {
    of(Side::Left).recording->stop();
    of(Side::Left).recording->start();
  });
}

PairReport NeverStops::run() {
  PairOptions options;
  options.period_s = 1;
  options.on_pair = [this](const Matched<FingerTouch>& pair) {
    if (pair.both())
      ++pairs_;
    else
      ++alone_[pair.left() ? 0 : 1];
  };
  options.on_progress = [this](uint64_t) { watch(); };
  PairReport report = run_pair(context(), {pair_finger(Side::Left), pair_finger(Side::Right)}, options);
  watch();
  return report;
}

/// A client that comes for one event and goes.
void NeverStops::visit() {
  const std::string events = topic(Side::Left, "events");
  CountingClient visitor(server_->port(), {events});
  while (visitor.all() == 0) visitor.take();
  visitor.unsubscribe(events);
  visitor.call();
  ++visits_;
  visitors_took_ += visitor.all();
}

/// A last touch of both fingers, once the run is over.
void NeverStops::send_the_end(uint64_t time) {
  for (const Side side : kSides) {
    Touch touch;
    touch.sequence = seconds_ + time;
    hub_->publish(index(side), of(side).background, Result(), touch);
  }
}

void NeverStops::expect_every_frame_accounted_for(const PairReport& report) {
  uint64_t measured = 0, thrown = 0;
  for (const Side side : kSides) {
    const LiveReport& r = report.fingers[index(side)];
    EXPECT_EQ(r.captured + r.camera.lost, seconds_);
    EXPECT_GT(r.camera.lost, 0u);
    EXPECT_EQ(r.processed + r.dropped_before_engine, r.captured);
    EXPECT_GT(r.dropped_before_engine, 0u);
    EXPECT_EQ(r.processed, of(side).measured);
    EXPECT_EQ(r.device_losses, kParts);
    // The test's way to lose a device costs the frame at which it threw.
    const uint64_t cost = of(side).lost_in.size();
    EXPECT_EQ(of(side).shown + r.dropped_before_display + cost, r.processed);
    EXPECT_EQ(pairs_ + alone_[index(side)] + cost, r.processed);
    EXPECT_EQ(report.alone[index(side)], alone_[index(side)]);
    measured += r.processed;
    thrown += cost;
  }
  EXPECT_EQ(thrown, kParts);
  EXPECT_EQ(report.skew.pairs(), pairs_);
  EXPECT_GT(pairs_, seconds_ * 85 / 100);
  EXPECT_GT(alone_[0], 0u);
  EXPECT_GT(alone_[1], 0u);
  EXPECT_NEAR(report.skew.mean_ms(), 20, 1);
  std::cout << seconds_ << " s: " << measured << " measured, " << pairs_ << " pairs, " << alone_[0] << " and "
            << alone_[1] << " alone, " << thrown << " devices lost\n";
}

void NeverStops::expect_sessions_whole(const PairReport& report) {
  const auto whole = [](const Recording::Written& session) {
    const SessionStatus& s = session.status;
    EXPECT_EQ(s.error, "");
    EXPECT_EQ(s.written, s.recorded);
    return s;
  };
  const std::vector<Recording::Written> left = of(Side::Left).recording->finish();
  EXPECT_EQ(left.size(), sessions_);
  // A frame that is measured after its session has ended counts as one that the next one does not hold.
  uint64_t recorded = 0, measured = 0;
  for (const Recording::Written& session : left) {
    recorded += whole(session).recorded;
    measured += session.status.measured + session.status.unmatched;
  }
  EXPECT_LE(recorded, report.fingers[0].captured);
  EXPECT_LE(measured, report.fingers[0].processed);
  EXPECT_GE(measured + kParts * 10, report.fingers[0].processed);
  const std::vector<Recording::Written> right = of(Side::Right).recording->finish();
  ASSERT_EQ(right.size(), 1u);
  const SessionStatus s = whole(right[0]);
  EXPECT_EQ(s.recorded + s.dropped, report.fingers[1].captured);
  EXPECT_EQ(s.measured, report.fingers[1].processed);
  EXPECT_EQ(s.unmatched, 0u);
  const Session session(right[0].folder);
  EXPECT_TRUE(session.complete());
  EXPECT_EQ(session.frame_count(), s.recorded);
}

void NeverStops::expect_every_message_accounted_for(CountingClient& reader, CountingClient& stalled) {
  // They are told of drops once a second at most, behind something else.
  std::this_thread::sleep_for(milliseconds(1100));
  for (CountingClient* client : {&reader, &stalled})
    for (int i = 0; i < 2; ++i) client->call();
  uint64_t touches_lost = 0, stalled_due = 0;
  for (const Side side : kSides) {
    const std::string touch = topic(side, "touch"), image = topic(side, "image");
    EXPECT_EQ(passed(touch), of(side).shown + 2);
    EXPECT_EQ(passed(image), of(side).shown + 2);
    touches_lost += passed(touch) - reader.received(touch);
    stalled_due += passed(touch) + passed(image);
  }
  EXPECT_LE(touches_lost, reader.told());  // and pictures
  EXPECT_GT(reader.received(topic(Side::Left, "image/compressed")), 0u);
  EXPECT_EQ(stalled.all() + stalled.told(), stalled_due);
  EXPECT_GT(stalled.told(), 0u);
  const ServeSummary s = server_->summary();
  EXPECT_EQ(s.sent, reader.all() + stalled.all() + visitors_took_);
  EXPECT_EQ(s.dropped, reader.told() + stalled.told());
  EXPECT_EQ(s.clients, 2 + visits_);
  EXPECT_EQ(s.refused + s.stalled, 0u);
  EXPECT_GE(visits_, 1u);
  std::cout << describe(s) << "; " << stalled.told() << " by the one that did not read\n";
}

void NeverStops::expect_flat() const {
  std::cout << "part,resident_MB,in_use_MB,files,threads\n";
  for (size_t i = 0; i < held_.size(); ++i)
    std::cout << text("%zu,%.2f,%.3f,%llu,%llu\n", i + 1, held_[i].resident_MB, held_[i].in_use_MB,
                      static_cast<unsigned long long>(most_files_[i]),
                      static_cast<unsigned long long>(held_[i].threads));
  ASSERT_EQ(held_.size(), kParts);
  // Queues are full after a third; the last part ends with the run.
  const auto usual = [&](double Held::*what, size_t middle) {
    std::array values = {held_[middle - 1].*what, held_[middle].*what, held_[middle + 1].*what};
    std::ranges::sort(values);
    return values[1];
  };
  const auto growth = [&](double Held::*what) { return usual(what, kParts - 3) - usual(what, kParts / 3); };
  // The index of a session in hand, which players need: one of the two lasts as long as the run.
  constexpr double kIndex_B = 40;
  const double index_MB = 1e-6 * kIndex_B * static_cast<double>(seconds_);
  EXPECT_LT(growth(&Held::in_use_MB), 1 + index_MB);
  EXPECT_LT(growth(&Held::resident_MB), 8 + index_MB);
  const auto half = most_files_.begin() + kParts / 2;
  EXPECT_LE(*std::max_element(half, most_files_.end()), *std::max_element(most_files_.begin(), half) + 6);
  EXPECT_LE(held_[kParts - 2].threads, held_[kParts / 3].threads + 6);
}

TEST_F(NeverStops, TwoFingersTheirSessionsAndClientsForADay) {
  std::atomic<bool> over{false};
  std::thread answers([&] {
    while (!over) {
      server_->carry_out([](size_t, const std::string&) { return std::string("{}"); });
      std::this_thread::sleep_for(milliseconds(2));
    }
  });
  const std::string picture = topic(Side::Left, "image/compressed");
  const std::array<std::string, 2> both = touches();
  CountingClient stalled(server_->port(),
                         {both[0], both[1], topic(Side::Left, "image"), topic(Side::Right, "image")}, 4096);
  CountingClient reader(server_->port(), {both[0], both[1], picture});
  reader.ready(picture);
  reader.call();
  std::thread reads([&] {
    // A client that says more than 200 times a second that it is ready is closed.
    auto ready_at = std::chrono::steady_clock::now();
    uint64_t pictures = 0;
    reader.take_until(seconds_, both, [&] {
      const auto now = std::chrono::steady_clock::now();
      if (reader.received(picture) == pictures || now - ready_at < milliseconds(20)) return;
      pictures = reader.received(picture);
      ready_at = now;
      reader.ready(picture);
    });
  });
  std::atomic<bool> ended{false};
  std::thread visits([&] {
    while (!ended) visit();
  });
  const PairReport report = run();
  send_the_end(0);
  reads.join();
  // The one that did not read is ready for a new picture, and so told of all that it missed, when it has got
  // what waited for it.
  stalled.take_until(seconds_, both, [] {});
  for (int i = 0; i < 2; ++i) stalled.call();
  send_the_end(1);
  for (CountingClient* client : {&reader, &stalled}) client->take_until(seconds_ + 1, both, [] {});
  std::thread last_events([&] {
    while (!over) {
      hub_->publish_event(0, {0, 0, "mark", "end"});
      std::this_thread::sleep_for(milliseconds(2));
    }
  });
  ended = true;
  visits.join();
  expect_every_frame_accounted_for(report);
  expect_sessions_whole(report);
  expect_every_message_accounted_for(reader, stalled);
  over = true;
  last_events.join();
  answers.join();
  expect_flat();
}

}  // namespace
}  // namespace palpate
