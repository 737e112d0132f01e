// Capture, engine and recorder without a window, from cameras that burst, stall and outrun what follows: the
// newest wins, the counters are right to the frame, and what was recorded measures again to the last digit.
#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "capture/files/measurements.h"
#include "capture/live/capture_thread.h"
#include "capture/live/live.h"
#include "capture/live/recorder.h"
#include "capture/run/process/verify_recording.h"
#include "capture/session/session.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "tests/support/eventually.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/test_folder.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;

SyntheticOptions scene() {
  SyntheticOptions options;
  options.scene = "slide";
  options.width = 160;
  options.height = 120;
  options.mode = SyntheticMode::Waveguide;
  options.rate_Hz = 60;
  return options;
}

/// With a force and a shear, so that shear can be valid.
Sensor sensor() {
  Sensor sensor = synthetic_sensor(scene());
  sensor.force = ForceCalibration{.c1_N_per_gray = 1e-6, .gray_max = 1e12};
  sensor.shear = ShearCalibration{.kx_N_per_mm = 1, .ky_N_per_mm = 1, .friction = 100};
  return sensor;
}

/// Decides when frames come, instead of a clock: the camera gives those that are let go, the consumer waits
/// until they are all there. A recorder that drops frames would leave both waiting for each other: no pace
/// then.
class Pace {
 public:
  explicit Pace(uint64_t frames) : frames_(frames) {}

  /// The camera: returns once frame `n` may come; all before it have been handed on.
  void ask(uint64_t n) {
    std::unique_lock lock(mutex_);
    asked_ = n;
    changed_.notify_all();
    changed_.wait_for(lock, kHangs, [&] { return n < let_go_ || n >= frames_; });
  }
  /// The consumer: lets `more` frames come and returns once the last of them, or of all, has been handed on.
  void let(uint64_t more) {
    std::unique_lock lock(mutex_);
    let_go_ = std::min(frames_, let_go_ + more);
    changed_.notify_all();
    EXPECT_TRUE(changed_.wait_for(lock, kHangs, [&] { return asked_ >= let_go_; }));
  }

 private:
  const uint64_t frames_;
  std::mutex mutex_;
  std::condition_variable changed_;
  uint64_t let_go_ = 1, asked_ = 0;
};

/// A camera whose frames come whether anybody takes them or not.
class FakeCamera : public Source {
 public:
  struct Script {
    uint64_t frames = 60;
    uint64_t gap_before = 0;  ///< a frame that is marked after_gap; 0: none
    uint64_t first = 0;       ///< frame of the scene to begin with
  };
  /// Without a pace all frames come at once, faster than any encoder is.
  FakeCamera(const Script& script, Pace* pace) : script_(script), pace_(pace) {
    for (uint64_t n = 0; !pace && n < script.frames; ++n)
      sensor_.render(script.first + n, ready_.emplace_back());
  }
  FrameFormat format() const override { return sensor_.format(); }
  double rate_Hz() const override { return 1e9 / kPeriod_ns; }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool live() const override { return true; }
  CaptureCounts counts() const override { return {.gaps = gaps_}; }
  bool next(Frame& frame) override {
    if (pace_) pace_->ask(count_);
    if (count_ == script_.frames) return false;
    const bool gap = script_.gap_before != 0 && count_ == script_.gap_before;
    gaps_ += gap;
    const int64_t now = monotonic_ns();
    if (pace_)
      sensor_.render(script_.first + count_, frame);
    else
      frame = ready_[count_];
    frame.after_gap = gap;
    frame.sequence = count_;
    frame.time_ns = static_cast<int64_t>(count_) * kPeriod_ns;
    frame.exposed_ns = now;
    frame.delivered_ns = monotonic_ns();
    ++count_;
    return true;
  }

 private:
  static constexpr int64_t kPeriod_ns = 4'000'000;
  Script script_;
  Pace* pace_;
  SyntheticSensor sensor_{scene()};
  std::vector<Frame> ready_;
  uint64_t count_ = 0;
  std::atomic<uint64_t> gaps_{0};
};

class LiveCaptureTest : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    folder_ = test_folder("live");
  }
  void TearDown() override {
    if (!HasFailure()) std::filesystem::remove_all(folder_);
    GpuTest::TearDown();
  }

  Frame background() const { return *SyntheticSensor(scene()).own_background(); }
  SessionInfo info() const {
    SessionInfo info;
    info.sensor = sensor();
    info.format = SyntheticSensor(scene()).format();
    info.rate_Hz = 60;
    info.background = background();
    info.outputs = Output::Force | Output::Surface;
    return info;
  }
  /// A camera gives `group` frames while one is measured: the engine gets the first, and the last of each
  /// group. 0: all frames come at once.
  LiveReport run(const FakeCamera::Script& script, uint64_t group, const Sensor& sensor, Outputs outputs) {
    Pace pace(script.frames);
    const auto heard = std::exchange(options_.on_result, {});
    options_.on_result = [&](const Touch& touch) {
      if (heard) heard(touch);
      if (group > 0) pace.let(group);
    };
    const Frame untouched = background();
    LiveReport report = run_without_window(
        context(), [&] { return std::make_unique<FakeCamera>(script, group > 0 ? &pace : nullptr); },
        {sensor, untouched, {.outputs = outputs}}, options_);
    EXPECT_EQ(report.captured, script.frames);
    EXPECT_EQ(report.processed + report.dropped_before_engine, report.captured);
    EXPECT_TRUE(report.latency_from_exposure);
    EXPECT_EQ(report.to_measured.count, report.processed);
    return report;
  }
  LiveReport run(const FakeCamera::Script& script, uint64_t group) {
    return run(script, group, sensor(), PipelineOptions().outputs);
  }
  /// Every recorded measurement once more, from the session alone.
  RecordedCheck measure_again(const std::filesystem::path& folder) {
    Session session(folder);
    MeasuredFrames frames(session);
    const Sensor measured_with = session.info().sensor.value_or(uncalibrated_sensor(session.format()));
    Pipeline pipeline(context(), measured_with, session.format(),
                      {.outputs = session.info().outputs,
                       .solver = session.info().solver,
                       .solve_by = session.info().solve_by});
    pipeline.set_background(*session.own_background());
    RecordedCheck check;
    Frame frame;
    while (frames.next(frame)) check.add(session, pipeline.process(frame).touch);
    return check;
  }

  std::filesystem::path folder_;
  LiveOptions options_;
};

/// A player measures every frame, however slowly, and goes round after round through the recording's own
/// times.
TEST_F(LiveCaptureTest, AReplayLeavesNoFrameOutAndItsLoopsHaveTheRecordingsTimes) {
  SyntheticOptions short_scene = scene();
  short_scene.rate_Hz = 400;
  static constexpr uint64_t kFrames = 12;
  class Recording : public SyntheticSensor {
   public:
    using SyntheticSensor::SyntheticSensor;
    std::optional<uint64_t> frame_count() const override { return kFrames; }
    bool next(Frame& frame) override { return given_++ < kFrames && SyntheticSensor::next(frame); }

   private:
    uint64_t given_ = 0;
  };
  std::vector<uint64_t> numbers;
  std::vector<int64_t> times_ns;
  options_.replay = options_.loop = true;
  options_.max_frames = 3 * kFrames;
  options_.on_result = [&](const Touch& touch) {
    numbers.push_back(touch.sequence);
    times_ns.push_back(touch.time_ns);
    std::this_thread::sleep_for(milliseconds(5));  // a frame comes every 2.5 ms
  };
  const Sensor pad = sensor();
  const Frame untouched = background();
  const LiveReport report = run_without_window(
      context(), [&] { return std::make_unique<Recording>(short_scene); }, {pad, untouched, {}}, options_);
  EXPECT_EQ(report.dropped_before_engine, 0u);
  ASSERT_EQ(numbers.size(), 3 * kFrames);
  for (uint64_t i = 0; i < 3 * kFrames; ++i) {
    EXPECT_EQ(numbers[i], i % kFrames);
    EXPECT_NEAR(static_cast<double>(times_ns[i]), 2.5e6 * static_cast<double>(i % kFrames), 2) << i;
  }
}

/// Ten frames, of which two are damaged.
class DamagedRecording : public SyntheticSensor {
 public:
  DamagedRecording() : SyntheticSensor(scene()) {}
  std::optional<uint64_t> frame_count() const override { return 10; }
  bool next(Frame& frame) override {
    while (next_ == 3 || next_ == 4) ++next_;
    if (next_ == 10) return false;
    render(next_++, frame);
    return true;
  }
  bool seek(uint64_t index) override {
    next_ = index;
    return index < 10;
  }
  std::optional<uint64_t> place() const override { return next_ - 1; }

 private:
  uint64_t next_ = 0;
};

/// A capture thread that plays the damaged recording as fast as its frames are taken.
class ReplayOfADamagedRecording : public testing::Test {
 protected:
  void play() {
    options_.replay = options_.unpaced = true;
    session_.use(open_());
    capture_.emplace(session_, open_, options_);
    thread_ = std::thread([this] { capture_->run(); });
  }
  void expect_next(uint64_t position) {
    const std::optional<CapturedPtr> item = session_.to_engine.take(kHangs);
    ASSERT_TRUE(item);
    EXPECT_EQ((*item)->position, position);
  }
  void TearDown() override {
    session_.stop = true;
    session_.to_engine.close();
    if (thread_.joinable()) thread_.join();
  }

  LiveSession session_;

 private:
  const OpenSource open_ = [] { return std::make_shared<DamagedRecording>(); };
  LiveOptions options_;
  std::optional<LiveCapture> capture_;
  std::thread thread_;
};

/// The player's position is the recording's, and a step back does not stay before frames that are left out.
TEST_F(ReplayOfADamagedRecording, CountsAsTheRecordingDoes) {
  play();
  for (const uint64_t position : {0u, 1u, 2u, 5u, 6u, 7u, 8u, 9u}) expect_next(position);
  session_.paused = true;
  for (const uint64_t position : {8u, 7u, 6u, 5u, 2u, 1u}) {
    session_.transport.steps = -1;
    expect_next(position);
    EXPECT_EQ(session_.transport.position, position);
  }
  session_.transport.seek_to = 3;
  expect_next(5);
}

TEST_F(ReplayOfADamagedRecording, PartIsPlayedAgainAndAgainUntilThePersonGoesOn) {
  session_.transport.part_first = 1;
  session_.transport.part_last = 6;
  play();
  for (const uint64_t position : {0u, 1u, 2u, 5u, 6u, 1u, 2u, 5u, 6u, 1u}) expect_next(position);
}

TEST_F(LiveCaptureTest, AConsumerSlowerThanTheCameraGetsTheNewest) {
  for (const uint64_t group : {1u, 5u, 16u}) {
    std::vector<uint64_t> seen, wanted;
    for (uint64_t n = 0; n < 60 + group - 1; n += group) wanted.push_back(std::min<uint64_t>(n, 59));
    options_.on_result = [&](const Touch& touch) { seen.push_back(touch.sequence); };
    const LiveReport report = run({.frames = 60}, group);
    EXPECT_EQ(seen, wanted);
    EXPECT_EQ(report.dropped_before_engine, 60 - wanted.size());
  }
}

TEST_F(LiveCaptureTest, AGapBeforeADroppedFrameIsOneBeforeTheNextMeasured) {
  // In contact all along, so that only the mark can tell that the contact's onset was not seen.
  std::vector<Touch> seen;
  options_.on_result = [&](const Touch& touch) { seen.push_back(touch); };
  const LiveReport report = run({.frames = 60, .gap_before = 31, .first = 60}, 10);
  EXPECT_EQ(report.camera.gaps, 1u);
  ASSERT_EQ(seen.size(), 7u);
  for (const Touch& t : seen) {
    ASSERT_TRUE(t.contact);
    const bool unseen = t.shear_x_N.validity == Validity::OnsetUnseen;
    EXPECT_EQ(unseen, t.sequence >= 31) << t.sequence;
  }
}

TEST_F(LiveCaptureTest, WithoutDropsEveryFrameIsRecordedHoweverSlowTheEngine) {
  Recording recording([&] { return folder_ / "session"; }, info(), {.queue_bytes = 1, .no_drop = true});
  recording.start();
  options_.recording = &recording;
  const LiveReport report = run({.frames = 80}, 20);
  const auto written = recording.finish();
  ASSERT_EQ(written.size(), 1u);
  EXPECT_EQ(written[0].status.error, "");
  EXPECT_EQ(written[0].status.dropped, 0u);
  EXPECT_EQ(written[0].status.recorded, 80u);
  EXPECT_EQ(written[0].status.written, 80u);
  EXPECT_EQ(written[0].status.measured, report.processed);
  EXPECT_EQ(report.dropped_before_engine, 75u);
  Session session(folder_ / "session");
  EXPECT_EQ(session.measured_sequences().size(), report.processed);
  SyntheticSensor truth(scene());
  Frame frame, expected;
  for (uint64_t i = 0; i < 80; ++i) {
    ASSERT_TRUE(session.next(frame));
    truth.render(i, expected);
    EXPECT_EQ(frame.sequence, i);
    EXPECT_EQ(frame.after_gap, i == 0);
    EXPECT_EQ(frame.bytes, expected.bytes) << "frame " << i;
  }
  EXPECT_FALSE(session.next(frame));
}

TEST_F(LiveCaptureTest, WhatWasMeasuredLiveIsMeasuredAgainToTheLastDigit) {
  // Begun in the middle of a contact, with frames that were dropped before the engine, and a gap.
  Recording recording([&] { return folder_ / "session"; }, info(), {.no_drop = true});
  options_.recording = &recording;
  uint64_t results = 0;
  options_.on_result = [&](const Touch&) {
    if (++results == 5) recording.start();
  };
  run({.frames = 120, .gap_before = 71, .first = 50}, 3);
  EXPECT_EQ(results, 41u);
  const auto written = recording.finish();
  ASSERT_EQ(written.size(), 1u);
  ASSERT_EQ(written[0].status.error, "");
  const RecordedCheck check = measure_again(folder_ / "session");
  EXPECT_EQ(check.equal, written[0].status.measured);
  EXPECT_EQ(check.equal, 36u);
  EXPECT_EQ(check.different, 0u) << check.first_difference;
}

TEST_F(LiveCaptureTest, WhatTheRecorderHasNoRoomForIsNotMeasuredEither) {
  // No frame may wait: whatever comes while the encoder has two is dropped.
  Recording recording([&] { return folder_ / "session"; }, info(), {.queue_bytes = 1, .most_behind_s = 0});
  recording.start();
  options_.recording = &recording;
  const LiveReport report = run({.frames = 160, .gap_before = 81, .first = 40}, 0);
  const auto written = recording.finish();
  ASSERT_EQ(written.size(), 1u);
  EXPECT_EQ(written[0].status.error, "");
  EXPECT_GT(written[0].status.dropped, 0u);
  EXPECT_EQ(written[0].status.recorded + written[0].status.dropped, report.captured);
  EXPECT_EQ(written[0].status.unmatched, 0u);
  EXPECT_EQ(written[0].status.measured, report.processed);
  const RecordedCheck check = measure_again(folder_ / "session");
  EXPECT_EQ(check.equal, report.processed);
  EXPECT_EQ(check.different, 0u) << check.first_difference;
}

TEST_F(LiveCaptureTest, AnUncalibratedCameraIsMeasuredInPixels) {
  SessionInfo uncalibrated = info();
  uncalibrated.sensor.reset();
  uncalibrated.outputs = Output::Force;
  Recording recording([&] { return folder_ / "session"; }, uncalibrated, {.no_drop = true});
  recording.start();
  options_.recording = &recording;
  uint64_t touching = 0;
  options_.on_result = [&](const Touch& touch) {
    touching += touch.contact;
    EXPECT_TRUE(std::isnan(touch.area_mm2));
    EXPECT_EQ(touch.force_N.validity, Validity::NotCalibrated);
    EXPECT_EQ(touch.contact, touch.area_px > 0);
  };
  run({.frames = 30, .first = 60}, 1, uncalibrated_sensor(uncalibrated.format), uncalibrated.outputs);
  EXPECT_EQ(touching, 30u);
  EXPECT_EQ(recording.finish().at(0).status.error, "");
  const RecordedCheck check = measure_again(folder_ / "session");
  EXPECT_EQ(check.equal, touching);
  EXPECT_EQ(check.different, 0u) << check.first_difference;
}

TEST_F(LiveCaptureTest, RecordingStartsAndStopsWhileFramesGoOn) {
  int sessions = 0;
  Recording recording([&] { return folder_ / ("session-" + std::to_string(sessions++)); }, info(),
                      {.no_drop = true});
  options_.recording = &recording;
  uint64_t results = 0;
  options_.on_result = [&](const Touch&) {
    if (++results % 10 == 0) recording.on() ? recording.stop() : recording.start();
  };
  run({.frames = 100}, 1);
  const auto written = recording.finish();
  EXPECT_EQ(sessions, 5);
  EXPECT_EQ(written.size(), 5u);
  for (const Recording::Written& w : written) {
    EXPECT_EQ(w.status.error, "");
    EXPECT_EQ(w.status.recorded, w.status.written);
    if (w.status.written == 0)
      continue;  // begun when the last frame had come; it opens as one without frames
    EXPECT_EQ(Session(w.folder).frame_count(), w.status.written);
  }
}

TEST_F(LiveCaptureTest, ARecordingThatCanWaitIsMeasuredFrameByFrame) {
  options_.unpaced = options_.measure_all = true;
  options_.max_frames = 50;
  uint64_t expected = 0;
  options_.on_result = [&](const Touch& touch) {
    EXPECT_EQ(touch.sequence, expected++);
    std::this_thread::sleep_for(milliseconds(expected % 7 == 0 ? 15 : 0));
  };
  const Sensor pad = sensor();
  const Frame untouched = background();
  const LiveReport report = run_without_window(
      context(), [] { return std::make_unique<SyntheticSensor>(scene()); }, {pad, untouched, {}}, options_);
  EXPECT_EQ(report.processed, 50u);
  EXPECT_EQ(report.dropped_before_engine, 0u);
}

}  // namespace
}  // namespace palpate
