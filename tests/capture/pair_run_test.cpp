// Two fingers on one device: each measures as if it were alone, and neither holds the other up.
#include "capture/pair/pair_run.h"

#include <atomic>
#include <thread>

#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "tests/support/gpu_fixture.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;

std::string grip_input(Side side) {
  return std::string("synthetic:grip?size=64x48&rate=60&skew_ms=4&side=") + to_string(side);
}

/// A camera that loses its plug after some frames.
class Unplugged : public SyntheticSensor {
 public:
  Unplugged(const SyntheticOptions& options, uint64_t frames) : SyntheticSensor(options), left_(frames) {}
  bool live() const override { return true; }
  std::string state() const override { return left_ > 0 ? "" : "camera unplugged; waiting"; }
  void watch(const std::function<bool()>& cancelled) override { cancelled_ = cancelled; }
  bool next(Frame& frame) override {
    if (left_ > 0) {
      --left_;
      return SyntheticSensor::next(frame);
    }
    while (!cancelled_()) std::this_thread::sleep_for(milliseconds(1));
    return false;
  }

 private:
  std::atomic<uint64_t> left_;
  std::function<bool()> cancelled_;
};

/// A camera or recording whose clock is another one for a while, from some frame on until before another.
class SetClock : public SyntheticSensor {
 public:
  SetClock(const SyntheticOptions& options, bool live, int64_t by_ns, uint64_t from, uint64_t to)
      : SyntheticSensor(options), live_(live), by_ns_(by_ns), from_(from), to_(to) {}
  bool live() const override { return live_; }
  bool next(Frame& frame) override {
    if (!SyntheticSensor::next(frame)) return false;
    if (frame.sequence >= from_ && frame.sequence < to_) frame.time_ns += by_ns_;
    // Cameras stamp on the host's clock, which began two hours ago.
    frame.exposed_ns = live_ ? 7'200'000'000'000 + frame.time_ns : 0;
    return true;
  }

 private:
  const bool live_;
  const int64_t by_ns_;
  const uint64_t from_, to_;
};

class PairRunTest : public GpuTest {
 protected:
  PairRunTest() {
    for (const Side side : kSides) {
      scene_[index(side)] = parse_synthetic(grip_input(side));
      sensor_[index(side)] = synthetic_sensor(scene_[index(side)]);
      background_[index(side)] = *SyntheticSensor(scene_[index(side)]).own_background();
    }
    options_.period_s = 1. / 60;
    options_.on_pair = [this](const Matched<FingerTouch>& pair) { pairs_.push_back(pair); };
  }
  PairFinger finger(Side side) {
    LiveOptions options;
    options.measure_all = options.unpaced = true;
    options.input = grip_input(side);
    return {[this, side] { return std::make_shared<SyntheticSensor>(scene_[index(side)]); },
            {sensor_[index(side)], background_[index(side)], {}},
            options};
  }
  /// Measured alone.
  std::vector<Touch> alone(Side side) {
    PairFinger one = finger(side);
    std::vector<Touch> touches;
    one.options.on_result = [&](const Touch& touch) { touches.push_back(touch); };
    run_without_window(context(), one.open, one.run, one.options);
    return touches;
  }
  /// Of all that came out.
  std::vector<Touch> of(Side side) const {
    std::vector<Touch> touches;
    for (const Matched<FingerTouch>& pair : pairs_)
      if (const auto& one = pair.of[index(side)]) touches.push_back(one->touch);
    return touches;
  }

  std::array<SyntheticOptions, 2> scene_;
  std::array<Sensor, 2> sensor_;
  std::array<Frame, 2> background_;
  PairOptions options_;
  std::vector<Matched<FingerTouch>> pairs_;
};

TEST_F(PairRunTest, EachFingerMeasuresAsIfAlone) {
  const PairReport report = run_pair(context(), {finger(Side::Left), finger(Side::Right)}, options_);
  EXPECT_EQ(report.skew.pairs(), 360u);
  EXPECT_NEAR(report.skew.mean_ms(), 4, 1e-6);
  EXPECT_NEAR(report.skew.sd_ms(), 0, 1e-6);
  EXPECT_EQ(report.alone[0] + report.alone[1], 0u);
  ASSERT_EQ(pairs_.size(), 360u);
  for (const Side side : kSides) {
    const std::vector<Touch> wanted = alone(side), found = of(side);
    ASSERT_EQ(found.size(), wanted.size());
    for (size_t k = 0; k < wanted.size(); ++k) {
      EXPECT_EQ(found[k].sequence, wanted[k].sequence);
      EXPECT_EQ(found[k].gray_sum, wanted[k].gray_sum);
      EXPECT_EQ(found[k].force_N.value, wanted[k].force_N.value);
      EXPECT_EQ(found[k].shear_y_N.value, wanted[k].shear_y_N.value);
    }
  }
}

TEST_F(PairRunTest, OneLosesItsCameraAndTheOtherGoesOn) {
  PairFinger left = finger(Side::Left);
  left.open = [this] { return std::make_shared<Unplugged>(scene_[0], 5); };
  left.options.measure_all = left.options.unpaced = false;
  left.options.patience_s = 0.05;
  std::vector<std::string> states;
  options_.on_state = [&](Side side, const std::string& state) {
    EXPECT_EQ(side, Side::Left);
    states.push_back(state);
  };
  try {
    run_pair(context(), {left, finger(Side::Right)}, options_);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_EQ(error.failure(), Failure::Device);
  }
  EXPECT_EQ(of(Side::Right).size(), 360u);
  ASSERT_GE(states.size(), 1u);
  EXPECT_NE((states.front() + states.back()).find("unplugged"), std::string::npos) << states.front();
}

// Frames of another time go out alone. A recording that jumps ahead waits, as one that has a gap, until the
// other one gets there or ends; one that jumps back does not, and pairs come again with the time.
TEST_F(PairRunTest, RecordingsWhoseTimeJumpsByAnHourComeOutWhole) {
  constexpr int64_t kHour_ns = 3'600'000'000'000;
  for (const int64_t by_ns : {kHour_ns, -kHour_ns})
    for (const uint64_t to : {200u, 1000u}) {
      pairs_.clear();
      PairFinger left = finger(Side::Left);
      left.open = [&] { return std::make_shared<SetClock>(scene_[0], false, by_ns, 100, to); };
      const PairReport report = run_pair(context(), {left, finger(Side::Right)}, options_);
      EXPECT_EQ(of(Side::Left).size(), 360u);
      EXPECT_EQ(of(Side::Right).size(), 360u);
      const uint64_t single = by_ns < 0 && to == 200 ? 100 : 260;
      EXPECT_EQ(report.skew.pairs(), 360 - single) << by_ns << ' ' << to;
      EXPECT_EQ(report.alone, (std::array{single, single}));
      EXPECT_NEAR(report.skew.mean_ms(), 4, 1e-6);
    }
}

TEST_F(PairRunTest, AClockOfBothThatIsSetCostsNoPair) {
  constexpr int64_t kHour_ns = 3'600'000'000'000;
  std::array<PairFinger, 2> both = {finger(Side::Left), finger(Side::Right)};
  for (const Side side : kSides)
    both[index(side)].open = [this, side] {
      return std::make_shared<SetClock>(scene_[index(side)], false, -kHour_ns, 100, 1000);
    };
  const PairReport report = run_pair(context(), both, options_);
  EXPECT_EQ(report.skew.pairs(), 360u);
  EXPECT_EQ(report.alone, (std::array<uint64_t, 2>{}));
}

TEST_F(PairRunTest, ACamerasFramesWaitForNoTimeThatDoesNotCome) {
  constexpr int64_t kHour_ns = 3'600'000'000'000;
  for (const int64_t by_ns : {kHour_ns, -kHour_ns}) {
    pairs_.clear();
    std::array<PairFinger, 2> both = {finger(Side::Left), finger(Side::Right)};
    for (const Side side : kSides) {
      both[index(side)].open = [this, side, by_ns] {
        return std::make_shared<SetClock>(scene_[index(side)], true, side == Side::Left ? by_ns : 0, 100,
                                          1000);
      };
      both[index(side)].options.unpaced = false;
    }
    const PairReport report = run_pair(context(), both, options_);
    for (const Side side : kSides) {
      EXPECT_EQ(of(side).size(), report.fingers[index(side)].processed);
      EXPECT_EQ(report.fingers[index(side)].captured, 360u);
      EXPECT_GE(report.alone[index(side)] + 100, of(side).size());
    }
  }
}

TEST_F(PairRunTest, ALostDeviceIsOpenedAnewForBoth) {
  // One finger finds it lost, twice, while the other is at work on it, and once while it is silent.
  PairFinger left = finger(Side::Left), right = finger(Side::Right);
  std::set<uint64_t> lost;
  left.options.on_result = [&](const Touch& touch) {
    if ((touch.sequence == 50 || touch.sequence == 200) && lost.insert(touch.sequence).second)
      throw DeviceLost("a device", "none", "the test");
  };
  int told = 0;
  options_.on_device_lost = [&](const DeviceLost&) { ++told; };
  const PairReport report = run_pair(context(), {left, right}, options_);
  EXPECT_EQ(report.fingers[0].device_losses, 2u);
  EXPECT_EQ(report.fingers[1].device_losses, 2u);
  EXPECT_EQ(told, 2);
  EXPECT_EQ(of(Side::Left).size(), 358u);  // but the frames at which the test threw
  EXPECT_EQ(of(Side::Right).size(), 360u);
}

TEST_F(PairRunTest, ALostDeviceIsOpenedAnewBesideASilentFinger) {
  PairFinger left = finger(Side::Left), right = finger(Side::Right);
  right.open = [this] { return std::make_shared<Unplugged>(scene_[1], 3); };
  right.options.measure_all = right.options.unpaced = false;
  std::atomic<bool> over = false;
  bool threw = false;
  left.options.on_result = [&](const Touch& touch) {
    if (touch.sequence == 100 && !std::exchange(threw, true))
      throw DeviceLost("a device", "none", "the test");
    if (touch.sequence == 359) over = true;
  };
  options_.interrupted = [&] { return over.load(); };
  const PairReport report = run_pair(context(), {left, right}, options_);
  EXPECT_EQ(report.fingers[0].device_losses, 1u);
  EXPECT_GE(of(Side::Left).size(), 350u);
}

}  // namespace
}  // namespace palpate
