// Capture, engine and recorder without a window, from cameras that burst, stall and outrun what follows: the
// newest wins, the counters are right to the frame, and what was recorded measures again to the last digit.
#include <atomic>
#include <cmath>
#include <filesystem>
#include <thread>

#include "capture/files/measurements.h"
#include "capture/run/verify_recording.h"
#include "capture/session/session.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/test_folder.h"
#include "viz/live/live.h"
#include "viz/live/recorder.h"

namespace palpate::viz {
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

/// A camera that nobody can hold up: what is not fetched in time is lost, as its driver's buffers are few.
class FakeCamera : public Source {
 public:
  struct Script {
    uint64_t frames = 60;
    milliseconds period{4};
    uint64_t burst = 1;         ///< that many at once, then as long a pause
    uint64_t stall_before = 0;  ///< a frame that comes late, marked after_gap; 0: none
    uint64_t first = 0;         ///< frame of the scene to begin with
  };
  explicit FakeCamera(const Script& script) : script_(script) {}
  FrameFormat format() const override { return sensor_.format(); }
  double rate_Hz() const override { return 1e3 / static_cast<double>(script_.period.count()); }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool live() const override { return true; }
  CaptureCounts counts() const override { return {.gaps = gaps_}; }
  bool next(Frame& frame) override {
    if (count_ == script_.frames) return false;
    if (count_ % script_.burst == 0) std::this_thread::sleep_for(script_.period * script_.burst);
    frame.after_gap = script_.stall_before != 0 && count_ == script_.stall_before;
    if (frame.after_gap) {
      std::this_thread::sleep_for(milliseconds(50));
      ++gaps_;
    }
    const int64_t now = monotonic_ns();
    const bool gap = frame.after_gap;
    sensor_.render(script_.first + count_, frame);
    frame.after_gap = gap;
    frame.sequence = count_;
    frame.time_ns = static_cast<int64_t>(count_) * std::chrono::nanoseconds(script_.period).count();
    frame.exposed_ns = now;
    frame.delivered_ns = monotonic_ns();
    ++count_;
    return true;
  }

 private:
  Script script_;
  SyntheticSensor sensor_{scene()};
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
  LiveReport run(const FakeCamera::Script& script) {
    const LiveReport report = run_without_window(
        context(), [&] { return std::make_unique<FakeCamera>(script); }, sensor(), background(), {},
        options_);
    EXPECT_EQ(report.captured, script.frames);
    EXPECT_EQ(report.processed + report.dropped_before_engine, report.captured);
    EXPECT_TRUE(report.latency_from_exposure);
    EXPECT_EQ(report.to_measured.count, report.processed);
    return report;
  }
  /// Every recorded measurement once more, from the session alone.
  RecordedCheck measure_again(const std::filesystem::path& folder) {
    Session session(folder);
    MeasuredFrames frames(session);
    const Sensor measured_with = session.info().sensor.value_or(uncalibrated_sensor(session.format()));
    Pipeline pipeline(context(), measured_with, session.format(),
                      {.outputs = session.info().outputs,
                       .solver = session.info().solver,
                       .skip_untouched = session.info().skip_untouched});
    pipeline.set_background(*session.own_background());
    RecordedCheck check;
    Frame frame;
    while (frames.next(frame)) check.add(session, pipeline.process(frame));
    return check;
  }

  std::filesystem::path folder_;
  LiveOptions options_;
};

TEST_F(LiveCaptureTest, AConsumerSlowerThanTheCameraGetsTheNewest) {
  std::vector<uint64_t> seen;
  options_.on_result = [&](const Touch& touch) {
    seen.push_back(touch.sequence);
    std::this_thread::sleep_for(milliseconds(20));
  };
  const LiveReport report = run({.frames = 60, .period = milliseconds(5)});
  EXPECT_EQ(seen.size(), report.processed);
  EXPECT_GT(report.dropped_before_engine, 20u);
  EXPECT_EQ(seen.back(), 59u);
  EXPECT_TRUE(std::is_sorted(seen.begin(), seen.end()));
}

TEST_F(LiveCaptureTest, BurstsAreCountedToTheFrame) {
  options_.on_result = [](const Touch&) { std::this_thread::sleep_for(milliseconds(8)); };
  const LiveReport report = run({.frames = 64, .period = milliseconds(4), .burst = 16});
  EXPECT_GE(report.processed, 4u);  // the last of each burst waits until it is taken
  EXPECT_GT(report.dropped_before_engine, 16u);
}

TEST_F(LiveCaptureTest, AGapBeforeADroppedFrameIsOneBeforeTheNextMeasured) {
  // In contact all along, so that only the mark can tell that the contact's onset was not seen.
  const FakeCamera::Script script{.frames = 60, .period = milliseconds(3), .stall_before = 31, .first = 60};
  std::vector<Touch> seen;
  options_.on_result = [&](const Touch& touch) {
    seen.push_back(touch);
    std::this_thread::sleep_for(milliseconds(30));
  };
  const LiveReport report = run(script);
  EXPECT_EQ(report.camera.gaps, 1u);
  ASSERT_GT(seen.size(), 2u);
  bool before = false, after = false;
  for (const Touch& t : seen) {
    ASSERT_TRUE(t.contact);
    const bool unseen = t.shear_x_N.validity == Validity::OnsetUnseen;
    EXPECT_EQ(unseen, t.sequence >= 31) << t.sequence;
    (t.sequence < 31 ? before : after) = true;
  }
  EXPECT_TRUE(before && after);
}

TEST_F(LiveCaptureTest, WithoutDropsEveryFrameIsRecordedHoweverSlowTheEngine) {
  Recording recording([&] { return folder_ / "session"; }, info(), {.queue_bytes = 1, .no_drop = true});
  recording.start();
  options_.recording = &recording;
  options_.on_result = [](const Touch&) { std::this_thread::sleep_for(milliseconds(25)); };
  const LiveReport report = run({.frames = 80, .period = milliseconds(2)});
  const auto written = recording.finish();
  ASSERT_EQ(written.size(), 1u);
  EXPECT_EQ(written[0].status.error, "");
  EXPECT_EQ(written[0].status.dropped, 0u);
  EXPECT_EQ(written[0].status.recorded, 80u);
  EXPECT_EQ(written[0].status.written, 80u);
  EXPECT_EQ(written[0].status.measured, report.processed);
  EXPECT_GT(report.dropped_before_engine, 0u);
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
    std::this_thread::sleep_for(milliseconds(10));
  };
  run({.frames = 120, .period = milliseconds(4), .stall_before = 70, .first = 50});
  const auto written = recording.finish();
  ASSERT_EQ(written.size(), 1u);
  ASSERT_EQ(written[0].status.error, "");
  const RecordedCheck check = measure_again(folder_ / "session");
  EXPECT_EQ(check.equal, written[0].status.measured);
  EXPECT_GT(check.equal, 20u);
  EXPECT_EQ(check.different, 0u) << check.first_difference;
}

TEST_F(LiveCaptureTest, WhatTheRecorderHasNoRoomForIsNotMeasuredEither) {
  Recording recording([&] { return folder_ / "session"; }, info(), {.queue_bytes = 1});
  recording.start();
  options_.recording = &recording;
  const LiveReport report =
      run({.frames = 160, .period = milliseconds(1), .burst = 40, .stall_before = 81, .first = 40});
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
  uncalibrated.outputs = static_cast<uint32_t>(Output::Force);
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
  // Slow enough that a busy machine, which drops frames, still measures some.
  const FakeCamera::Script script{.frames = 30, .period = milliseconds(20), .first = 60};
  run_without_window(
      context(), [&] { return std::make_unique<FakeCamera>(script); },
      uncalibrated_sensor(uncalibrated.format), background(), {.outputs = uncalibrated.outputs}, options_);
  EXPECT_GT(touching, 5u);
  EXPECT_EQ(recording.finish().at(0).status.error, "");
  const RecordedCheck check = measure_again(folder_ / "session");
  EXPECT_EQ(check.equal, touching);
  EXPECT_EQ(check.different, 0u) << check.first_difference;
}

TEST_F(LiveCaptureTest, RecordingStartsAndStopsWhileFramesGoOn) {
  int sessions = 0;
  Recording recording([&] { return folder_ / ("session-" + std::to_string(sessions++)); }, info(), {});
  options_.recording = &recording;
  uint64_t results = 0;
  options_.on_result = [&](const Touch&) {
    if (++results % 10 == 0) recording.on() ? recording.stop() : recording.start();
  };
  run({.frames = 100, .period = milliseconds(8)});
  const auto written = recording.finish();
  EXPECT_EQ(static_cast<int>(written.size()), sessions);
  EXPECT_GE(written.size(), 2u);
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
  const LiveReport report = run_without_window(
      context(), [] { return std::make_unique<SyntheticSensor>(scene()); }, sensor(), background(), {},
      options_);
  EXPECT_EQ(report.processed, 50u);
  EXPECT_EQ(report.dropped_before_engine, 0u);
}

}  // namespace
}  // namespace palpate::viz
