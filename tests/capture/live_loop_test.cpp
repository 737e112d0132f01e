// Ends of the live loop: a camera that stays away, a recording that is damaged, and who waits for whom.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>

#include "capture/live/live.h"
#include "capture/run/run_recording.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;

SyntheticOptions endless_scene() {
  SyntheticOptions options;
  options.width = 64;
  options.height = 48;
  options.rate_Hz = 400;
  return options;
}

/// Gives some frames; then it is silent as a camera without its plug, or damaged as a file is.
class Ending : public SyntheticSensor {
 public:
  enum class End { Unplugged, Damaged };
  Ending(uint64_t frames, End end) : SyntheticSensor(endless_scene()), frames_(frames), end_(end) {}

  bool live() const override { return end_ == End::Unplugged; }
  std::string state() const override { return given_ < frames_ ? "" : "camera unplugged; waiting"; }
  void watch(const std::function<bool()>& cancelled) override { cancelled_ = cancelled; }
  bool next(Frame& frame) override {
    if (given_ < frames_) {
      ++given_;
      return SyntheticSensor::next(frame);
    }
    if (end_ == End::Damaged) throw Error(Failure::Input, "frame 7", "damaged data", "another copy");
    while (!cancelled_()) std::this_thread::sleep_for(milliseconds(1));
    return false;
  }

 private:
  const uint64_t frames_;
  const End end_;
  std::atomic<uint64_t> given_{0};
  std::function<bool()> cancelled_;
};

class LiveLoop : public GpuTest {
 protected:
  /// The error of a session that must end with one.
  Error run(uint64_t frames, Ending::End end) {
    const Sensor sensor = synthetic_sensor(endless_scene());
    const Frame background = *SyntheticSensor(endless_scene()).own_background();
    try {
      run_without_window(
          context(), [&] { return std::make_shared<Ending>(frames, end); }, {sensor, background, {}},
          options_);
    } catch (const Error& error) {
      return error;
    }
    ADD_FAILURE() << "no error";
    return {Failure::Usage, "", "", ""};
  }
  std::vector<uint64_t> seen_;
  LiveOptions options_;
};

TEST_F(LiveLoop, PatienceWithACameraEnds) {
  options_.input = "camera:/dev/video7";
  options_.patience_s = 0.05;
  options_.measure_all = true;
  options_.loop = true;  // what is gone is not opened again
  options_.on_result = [&](const Touch& touch) { seen_.push_back(touch.sequence); };
  const Error error = run(5, Ending::End::Unplugged);
  EXPECT_EQ(error.failure(), Failure::Device);
  EXPECT_STREQ(
      error.what(),
      "wanted frames of camera:/dev/video7; found camera unplugged; try plugging the camera in again "
      "and opening it anew, or more patience");
  EXPECT_EQ(seen_, (std::vector<uint64_t>{0, 1, 2, 3, 4}));
}

TEST_F(LiveLoop, FramesBeforeADamagedOneAreShownHoweverSlowTheViewer) {
  options_.unpaced = options_.measure_all = options_.show_all = true;
  options_.draw = [&](const Frame& frame, const Result& result) {
    EXPECT_EQ(frame.sequence, result.touch.sequence);
    seen_.push_back(frame.sequence);
    std::this_thread::sleep_for(milliseconds(frame.sequence % 3 == 0 ? 10 : 0));
  };
  const Error error = run(7, Ending::End::Damaged);
  EXPECT_EQ(error.failure(), Failure::Input);
  EXPECT_EQ(seen_, (std::vector<uint64_t>{0, 1, 2, 3, 4, 5, 6}));
}

TEST_F(LiveLoop, AFailingViewerEndsTheSession) {
  options_.unpaced = options_.measure_all = options_.show_all = true;
  options_.draw = [&](const Frame&, const Result&) {
    throw Error(Failure::Output, "a file", "a full disk", "another disk");
  };
  EXPECT_EQ(run(1000, Ending::End::Damaged).failure(), Failure::Output);
}

TEST_F(LiveLoop, ARecordingRunsToItsLimitOrToAFrame) {
  Pipeline pipeline(context(), synthetic_sensor(endless_scene()), SyntheticSensor(endless_scene()).format(),
                    {.outputs = Output::Force, .slots = 1});
  pipeline.set_background(*SyntheticSensor(endless_scene()).own_background());
  const auto frames_of = [&](uint64_t limit, uint64_t end, const std::function<bool()>& stop) {
    seen_.clear();
    SyntheticSensor source(endless_scene());
    const uint64_t done = run_recording(
        source, pipeline, limit, stop,
        [&](const Result&, const Frame& frame) { seen_.push_back(frame.sequence); }, end);
    EXPECT_EQ(done, seen_.size());
    return done;
  };
  EXPECT_EQ(frames_of(9, UINT64_MAX, {}), 9u);
  EXPECT_EQ(seen_.back(), 8u);
  EXPECT_EQ(frames_of(0, 6, {}), 6u);
  EXPECT_EQ(frames_of(3, 6, {}), 3u);
  EXPECT_EQ(frames_of(0, UINT64_MAX, [] { return true; }), 0u);
  EXPECT_LT(frames_of(0, UINT64_MAX, [&] { return seen_.size() >= 4; }), 12u);
}

}  // namespace
}  // namespace palpate
