#include "viz/display/run_live.h"
#include "viz/render/desktop.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "capture/synthetic/synthetic.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"

namespace palpate::viz {
namespace {

SyntheticOptions gel() {
  SyntheticOptions options;
  options.width = 160;
  options.height = 120;
  options.mode = SyntheticMode::Gel;
  options.rate_Hz = 120;
  return options;
}

/// Delivers a few frames of a simulated touch, then fails as a damaged file does.
class DamagedSource : public Source {
 public:
  FrameFormat format() const override { return inner_.format(); }
  double rate_Hz() const override { return 120; }
  std::optional<uint64_t> frame_count() const override { return std::nullopt; }
  bool next(Frame& frame) override {
    if (++count_ > 5) throw Error(Failure::Input, "frame 5 of the recording", "damaged data", "another copy");
    return inner_.next(frame);
  }

 private:
  SyntheticSensor inner_{gel()};
  int count_ = 0;
};

/// A window on the display that there is: tests/run starts a virtual one.
class LiveTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!display_available()) GTEST_SKIP() << "no display";
    gpu::ContextOptions options;
    options.validation = true;
    options.presentation = true;
    options.instance_extensions = window_extensions();
    context_ = std::make_unique<gpu::Context>(options);
    shown_.width = 640;
    shown_.height = 400;
  }
  void TearDown() override {
    if (!context_) return;
    for (const std::string& message : context_->validation_messages()) ADD_FAILURE() << message;
  }
  LiveReport run(const OpenSource& open) {
    const SyntheticOptions scene = gel();
    const Sensor sensor = synthetic_sensor(scene);
    const Frame background = *SyntheticSensor(scene).own_background();
    return run_live(*context_, open, {sensor, background, {}}, options_, shown_);
  }

  std::unique_ptr<gpu::Context> context_;
  LiveOptions options_;
  WindowRun shown_;
};

TEST_F(LiveTest, EveryFrameIsShownOrCountedAsDropped) {
  options_.max_frames = 90;
  options_.close_at_end = true;
  uint64_t measured = 0, last = 0;
  bool ordered = true;
  options_.on_result = [&](const Touch& touch) {
    ordered = ordered && (measured == 0 || touch.sequence > last);
    last = touch.sequence;
    ++measured;
  };
  uint64_t fates = 0;
  options_.on_times = [&](const FrameTimes& times) {
    ++fates;
    EXPECT_GE(times.measured_ns, times.delivered_ns);
    if (times.shown_ns != 0) {
      EXPECT_GT(times.shown_ns, times.measured_ns);
    }
  };
  const LiveReport report = run([] { return std::make_unique<SyntheticSensor>(gel()); });
  EXPECT_EQ(report.captured, 90u);
  EXPECT_EQ(report.processed, measured);
  EXPECT_EQ(report.processed + report.dropped_before_engine, report.captured);
  EXPECT_EQ(report.shown + report.dropped_before_display, report.processed);
  EXPECT_TRUE(ordered);
  EXPECT_GT(report.shown, 0u);
  EXPECT_EQ(report.to_measured.count, report.processed);
  EXPECT_EQ(report.to_shown.count, report.shown);
  EXPECT_GT(report.to_measured.p50_ms, 0);
  EXPECT_EQ(fates, report.processed);
  EXPECT_GE(report.to_shown.p95_ms, report.to_shown.p50_ms);
  EXPECT_GE(report.to_shown.p99_ms, report.to_shown.p95_ms);
  EXPECT_FALSE(report.latency_from_exposure);  // a simulated frame has no exposure
  EXPECT_FALSE(report.interrupted);
}

TEST_F(LiveTest, TheLastFrameIsNeverDropped) {
  options_.max_frames = 40;
  options_.close_at_end = true;
  uint64_t last = 0;
  options_.on_result = [&](const Touch& touch) { last = touch.sequence; };
  run([] { return std::make_unique<SyntheticSensor>(gel()); });
  EXPECT_EQ(last, 39u);
}

/// A recording of 20 frames.
struct Short : Source {
  FrameFormat format() const override { return inner.format(); }
  double rate_Hz() const override { return 120; }
  std::optional<uint64_t> frame_count() const override { return 20; }
  bool next(Frame& frame) override { return ++count <= 20 && inner.next(frame); }
  SyntheticSensor inner{gel()};
  int count = 0;
};

// A replay's charts and bar are those of the recording, in every round.
TEST_F(LiveTest, ALoopedReplayKeepsToTheRecordingsTimes) {
  options_.max_frames = 60;
  options_.close_at_end = options_.loop = options_.replay = true;
  int64_t last_ns = 0;
  uint64_t largest = 0;
  options_.on_result = [&](const Touch& touch) {
    last_ns = std::max(last_ns, touch.time_ns);
    largest = std::max(largest, touch.sequence);
  };
  const LiveReport report = run([] { return std::make_unique<Short>(); });
  EXPECT_EQ(report.captured, 60u);
  EXPECT_LE(largest, 19u);
  EXPECT_LE(last_ns, 160'000'000) << "19 frames of 1/120 s";
}

TEST_F(LiveTest, LoopedRecordingKeepsTimeAndNumbersGoingOn) {
  options_.max_frames = 60;
  options_.close_at_end = true;
  options_.loop = true;
  int64_t last_ns = -1;
  bool ordered = true;
  uint64_t last = 0;
  options_.on_result = [&](const Touch& touch) {
    ordered = ordered && touch.time_ns > last_ns;
    last_ns = touch.time_ns;
    last = touch.sequence;
  };
  run([] { return std::make_unique<Short>(); });
  EXPECT_TRUE(ordered);
  EXPECT_EQ(last, 59u);
}

TEST_F(LiveTest, AnErrorOfTheSourceReachesTheCaller) {
  try {
    run([] { return std::make_unique<DamagedSource>(); });
    FAIL() << "the damaged recording was not noticed";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Input);
    EXPECT_NE(std::string(error.what()).find("damaged data"), std::string::npos);
  }
}

TEST_F(LiveTest, CtrlCEndsCleanly) {
  std::atomic<int> polls{0};
  options_.interrupted = [&] { return ++polls > 20; };
  const LiveReport report = run([] { return std::make_unique<SyntheticSensor>(gel()); });
  EXPECT_TRUE(report.interrupted);
}

}  // namespace
}  // namespace palpate::viz
