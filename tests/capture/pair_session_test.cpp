// A simulated grip recorded by two fingers: what both say of the object is its truth, and the recorded pair
// measured again says the same.
#include "capture/pair/pair_session.h"

#include <atomic>
#include <fstream>
#include <map>
#include <set>
#include <thread>

#include "capture/log/session_logs.h"
#include "capture/pair/pair_clock.h"
#include "capture/pair/pair_recording.h"
#include "capture/synthetic/synthetic.h"
#include "palpate/error.h"
#include "tests/support/csv_table.h"
#include "tests/support/gpu_fixture.h"
#include "tests/support/text_file.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kObject =
    "size=320x240&rate=30&weight_N=0.6&stiffness_N_per_mm=1.5&thickness_mm=24&skew_ms=5&side=";

std::string finger(Side side, const std::string& object = kObject) {
  return "synthetic:grip?" + object + to_string(side);
}

class PairSession : public GpuTest {
 protected:
  void SetUp() override {
    GpuTest::SetUp();
    folder_ = fs::path(testing::TempDir()) / "pair_session";
    fs::remove_all(folder_);
  }
  void TearDown() override {
    fs::remove_all(folder_);
    GpuTest::TearDown();
  }
  PairOutcome record(const fs::path& out, const std::string& object = kObject,
                     const std::function<void(PairRequest&)>& change = {}) {
    PairRequest request;
    for (const Side side : kSides) {
      request.fingers[index(side)].input = finger(side, object);
      request.fingers[index(side)].seed = 1 + index(side);
    }
    request.out = out;
    request.on_row = [this](const GripFrame& frame) { rows_.push_back(frame); };
    if (change) change(request);
    return record_pair([this]() -> gpu::Context& { return context(); }, request, {});
  }
  PairOutcome process(const fs::path& from, const fs::path& out) {
    return process_pair([this]() -> gpu::Context& { return context(); }, from, out, {}, {});
  }

  fs::path folder_;
  std::vector<GripFrame> rows_;
};

TEST_F(PairSession, SaysTheTruthOfTheObject) {
  const PairOutcome outcome = record(folder_);
  const GripScript script(parse_synthetic(finger(Side::Left)));
  EXPECT_EQ(outcome.run.skew.pairs(), 180u);
  EXPECT_NEAR(outcome.run.skew.mean_ms(), 5, 1e-6);
  ASSERT_EQ(rows_.size(), 180u);
  int held = 0, lifted = 0, good_force = 0, good_thickness = 0, good_load = 0;
  const auto within = [](const Estimate& e, double truth, double sds) {
    return std::abs(e.value - truth) <= sds * e.standard_error;
  };
  std::optional<Grip> hardest;
  for (const GripFrame& row : rows_) {
    ASSERT_TRUE(row.grip);
    const Grip& grip = *row.grip;
    const double time_s = 1e-9 * static_cast<double>(row.time_ns);
    const GripTruth truth = script.at(time_s);
    if (truth.force_N < 0.2) continue;
    ++held;
    EXPECT_TRUE(grip.force_N.valid());
    EXPECT_TRUE(grip.thickness_mm.valid()) << to_string(grip.thickness_mm.validity);
    good_force += within(grip.force_N, truth.force_N, 3);
    good_thickness += within(grip.thickness_mm, truth.thickness_mm, 3);
    EXPECT_NEAR(grip.force_N.value, truth.force_N, 0.02) << time_s;
    EXPECT_NEAR(grip.thickness_mm.value, truth.thickness_mm, 0.03) << time_s;
    EXPECT_NEAR(grip.load_x_N.value, 0, 0.02) << time_s;
    EXPECT_NEAR(grip.load_z_N.value, truth.load_z_N, 0.03) << time_s;
    good_load += within(grip.load_z_N, truth.load_z_N, 3);
    if (truth.load_z_N < -0.59) ++lifted;
    if (time_s > 4.5 && time_s < 4.7) hardest = grip;
  }
  EXPECT_GE(held, 130);
  EXPECT_GE(lifted, 30);
  EXPECT_GE(good_force, held * 95 / 100);
  EXPECT_GE(good_thickness, held * 95 / 100);
  EXPECT_GE(good_load, held * 95 / 100);
  ASSERT_TRUE(hardest);
  EXPECT_EQ(hardest->stiffness, StiffnessState::Known);
  EXPECT_TRUE(within(hardest->stiffness_N_per_mm, 1.5, 2));
  EXPECT_NEAR(hardest->stiffness_N_per_mm.value, 1.5, 0.05);
}

TEST_F(PairSession, AnEndlessGripKnowsItsOpeningInEachRound) {
  const std::string object = "size=64x48&repeat=0&side=";
  const auto grip = simulated_grip(finger(Side::Left, object), finger(Side::Right, object));
  ASSERT_TRUE(grip);
  const GripScript script(parse_synthetic(finger(Side::Left, object)));
  for (double time_s = 0; time_s < 20; time_s += 0.31)
    EXPECT_NEAR(grip->opening.at(time_s).value, script.at(time_s).opening_mm, 1e-6) << time_s;
}

TEST_F(PairSession, ALogIsOnTheClockOfBoth) {
  record(folder_ / "a");
  const FrameClock clock = pair_clock(folder_ / "a", folder_ / "a" / kPairRows);
  ASSERT_EQ(clock.time_s.size(), rows_.size());
  for (size_t k = 0; k < rows_.size(); ++k)  // the middle of both is half the skew behind the left one
    EXPECT_NEAR(clock.time_s[k] + 0.0025, 1e-9 * static_cast<double>(rows_[k].time_ns), 2e-6);
  // A robot whose clock began elsewhere, with the force that it closes with.
  const GripScript script(parse_synthetic(finger(Side::Left)));
  fs::create_directory(folder_ / "a" / kLogFolder);
  std::ofstream lines(folder_ / "a" / kLogFolder / "robot.lines");
  lines << "0\ttime_s,fz_N\n";
  for (double time_s = 0; time_s < 6; time_s += 0.01)
    lines << "0\t" << time_s + 57.3 << ',' << script.at(time_s).force_N << '\n';
  lines.close();
  const PairOutcome again = process(folder_ / "a", folder_ / "b");
  ASSERT_EQ(again.logs.size(), 1u);
  EXPECT_NE(again.logs[0].find("robot"), std::string::npos) << again.logs[0];
  const Table table(slurp(folder_ / "b" / "robot_log.csv"));
  ASSERT_EQ(table.rows.size(), 180u) << again.logs[0];
  double squares = 0;
  for (size_t k = 30; k < 150; ++k) {
    const double time_s = table.number(k, "time_s");
    squares += std::pow(table.number(k, "fz_N") - script.at(time_s).force_N, 2) / 120;
  }
  EXPECT_LT(std::sqrt(squares), 0.01);
}

TEST_F(PairSession, MeasuredAgainIsTheSame) {
  record(folder_ / "a");
  EXPECT_TRUE(is_pair_session(folder_ / "a"));
  const PairOutcome again = process(folder_ / "a", folder_ / "b");
  EXPECT_EQ(again.rows, 180u);
  EXPECT_EQ(slurp(folder_ / "b" / kPairRows), slurp(folder_ / "a" / kPairRows));
  EXPECT_EQ(slurp(folder_ / "b" / kOpeningLog), slurp(folder_ / "a" / kOpeningLog));
  for (const Side side : kSides) {
    const Session session(finger_folder(folder_ / "a", side));
    EXPECT_TRUE(session.complete());
    EXPECT_EQ(session.frame_count(), 180u);
    EXPECT_TRUE(fs::exists(finger_folder(folder_ / "b", side) / "measurements.csv"));
  }
  const PairInfo info = read_pair_info(folder_ / "a");
  EXPECT_TRUE(info.complete);
  EXPECT_NEAR(info.period_s, 1. / 30, 1e-12);
  ASSERT_TRUE(info.grip);
}

TEST_F(PairSession, WithoutPosesForcesAlongTheNormalsAreKnown) {
  // A side with another rate: no grip of one script, and frames without a partner.
  const auto other = [](PairRequest& request) {
    request.fingers[0].input = "synthetic:press?size=160x120&rate=30";
    request.fingers[1].input = "synthetic:press?size=160x120&rate=15";
    request.fingers[0].max_frames = 90;
  };
  const PairOutcome outcome = record(folder_, kObject, other);
  // Every other left frame, and the last one with the right one half a period after it.
  EXPECT_EQ(outcome.run.skew.pairs(), 46u);
  EXPECT_EQ(outcome.run.alone[0], 90u - 46u);
  EXPECT_EQ(outcome.run.alone[1], 120u - 46u);  // the right one goes on to its end
  bool pressed = false;
  for (const GripFrame& row : rows_) {
    if (!row.grip) continue;
    EXPECT_NE(row.grip->load_z_N.validity, Validity::Valid);
    EXPECT_NE(row.grip->thickness_mm.validity, Validity::Valid);
    pressed = pressed || row.grip->force_N.valid();
  }
  EXPECT_TRUE(pressed);
}

TEST_F(PairSession, RefusesWhatItCannotPairOrOverwrites) {
  const auto refused = [&](const std::function<void(PairRequest&)>& change) {
    try {
      record(folder_, kObject, change);
    } catch (const Error& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  fs::create_directories(folder_);
  spill(folder_ / "grip.json", R"({"left": {"rotation": [[1,0,0],[0,1,0],[0,0,1]]},
    "right": {"rotation": [[0,0,1],[1,0,0],[0,1,0]]}})");
  EXPECT_NE(refused([&](PairRequest& r) { r.grip = folder_ / "grip.json"; }).find("left pad that looks away"),
            std::string::npos);
  spill(folder_ / kPairJson, "{}");
  EXPECT_NE(refused({}).find("another --out folder"), std::string::npos);
  EXPECT_THROW(read_pair_info(folder_), Error);
}

TEST_F(PairSession, BeginsAndEndsWhileFramesGoOn) {
  const RunWatch watch;
  std::array<RunSettings, 2> settings;
  for (const Side side : kSides) settings[index(side)].input = finger(side);
  std::array<OpenFinger, 2> fingers = {OpenFinger(settings[0], false, watch),
                                       OpenFinger(settings[1], false, watch)};
  int folders = 0;
  PairRecording recording([&] { return folder_ / std::to_string(++folders); }, fingers, context(),
                          simulated_grip(settings[0].input, settings[1].input), true, watch);
  for (const Side side : kSides) fingers[index(side)].live.recording = &recording.of(side);
  // What is done at which pair; frames wait meanwhile, but those that are taken already go on.
  const std::map<int, std::function<void()>> at = {
      {30, [&] { recording.start(); }}, {90, [&] { recording.stop(); }}, {120, [&] { recording.start(); }}};
  std::atomic<int> pairs = 0, done = 0;
  PairOptions options;
  options.period_s = pair_info(fingers).period_s;
  std::array<std::vector<GripFrame>, 2> rows;
  options.on_pair = [&](const Matched<FingerTouch>& pair) {
    if (const auto row = recording.add(pair)) rows[pairs < 118 ? 0 : 1].push_back(*row);
    const int now = ++pairs;
    while (at.contains(now) && done < now) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  };
  options.interrupted = [&] {
    const int now = pairs;
    if (const auto step = at.find(now); step != at.end() && done < now) {
      step->second();
      done = now;
    }
    return false;
  };
  run_pair(context(), {fingers[0].pair(), fingers[1].pair()}, options);
  const std::vector<PairRecording::Written> written = recording.finish();
  ASSERT_EQ(written.size(), 2u);
  for (size_t k = 0; k < 2; ++k) {
    SCOPED_TRACE(k);
    EXPECT_EQ(written[k].error(), "");
    EXPECT_TRUE(is_pair_session(written[k].folder));
    EXPECT_EQ(written[k].rows, rows[k].size());
    EXPECT_TRUE(read_pair_info(written[k].folder).complete);
    // Every recorded frame has its row, and no other.
    for (const Side side : kSides) {
      std::set<uint64_t> recorded, in_rows;
      Session session(finger_folder(written[k].folder, side));
      for (Frame frame; session.next(frame);) recorded.insert(frame.sequence);
      for (const GripFrame& row : rows[k])
        if (const auto& frame = side == Side::Left ? row.left : row.right) in_rows.insert(*frame);
      EXPECT_GE(recorded.size(), 20u);
      EXPECT_EQ(in_rows, recorded) << to_string(side);
    }
    // The opening is that of the recording's own time: measured again it says the same.
    const fs::path again = folder_ / ("again" + std::to_string(k));
    process(written[k].folder, again);
    EXPECT_EQ(slurp(again / kPairRows), slurp(written[k].folder / kPairRows));
  }
}

}  // namespace
}  // namespace palpate
