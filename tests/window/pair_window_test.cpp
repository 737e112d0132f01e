// Two fingers in one window: what it shows in words, a device that is lost behind it, and its keys.
#include "viz/display/pair_window.h"

#include <algorithm>
#include <atomic>

#include "capture/pair/finger.h"
#include "capture/synthetic/synthetic.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "tests/support/csv_table.h"
#include "tests/support/gpu_fixture.h"
#include "tests/window/desktop.h"
#include "tests/window/letters.h"
#include "viz/display/pair_view.h"
#include "viz/render/desktop.h"

namespace palpate {
namespace viz {
namespace {

std::string finger(Side side, const char* more = "size=160x120&rate=60") {
  return std::string("synthetic:grip?") + more + "&side=" + to_string(side);
}

class PairWords : public GpuTest {};

TEST_F(PairWords, AreWholeAtEachSizeAndSayTheGrip) {
  // A pair in the middle of its grip.
  std::array<Sensor, 2> sensors;
  std::array<std::optional<Pipeline>, 2> pipelines;
  std::array<Frame, 2> frames;
  std::array<Result, 2> results;
  PairContent shown;
  const std::optional<KnownGrip> grip = simulated_grip(finger(Side::Left), finger(Side::Right));
  PairMeter meter(grip);
  std::vector<GripFrame> rows;
  std::array<std::optional<SyntheticSensor>, 2> sources;
  for (const Side side : kSides) {
    const size_t i = index(side);
    const SyntheticOptions scene = parse_synthetic(finger(side));
    sensors[i] = synthetic_sensor(scene);
    sources[i].emplace(scene);
    pipelines[i].emplace(context(), sensors[i], sources[i]->format(), PipelineOptions{});
    pipelines[i]->set_background(*sources[i]->own_background());
  }
  for (int k = 0; k < 200; ++k) {
    Matched<FingerTouch> pair;
    for (size_t i = 0; i < 2; ++i) {
      ASSERT_TRUE(sources[i]->next(frames[i]));
      results[i] = pipelines[i]->process(frames[i]);
      pair.of[i] = FingerTouch{results[i].touch, frames[i].time_ns};
    }
    rows.push_back(meter.add(pair));
  }
  shown.grip = rows.back();
  shown.note = "snapshots (S) and marks (M) go to /home/somebody/palpate";
  for (size_t i = 0; i < 2; ++i)
    shown.fingers[i] = {&frames[i], &results[i].touch, &results[i], results[i].touch, "", 59.7};
  const RenderPass pass(context(), OffscreenTarget::kFormat, choose_samples(context()),
                        VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  const auto words_at = [&](VkExtent2D extent, float scale) {
    OffscreenTarget target(context(), pass, extent);
    PairView view(context(), pass, sensors, 1, nullptr, scale);
    for (const GripFrame& row : rows) view.follow(row);
    for (size_t i = 0; i < 2; ++i)
      if (shown.fingers[i].touch) view.follow(*shown.fingers[i].touch);
    target.begin();
    view.record(target.cmd(), extent, shown, 128, {}, [&] { target.begin_pass(); });
    const std::vector<Letter> letters = letters_of(*ImGui::GetDrawData());
    target.finish();
    EXPECT_EQ(fault_of(letters, scale), "");
    return words_of(letters);
  };
  for (const auto& [extent, scale] :
       {std::pair{VkExtent2D{800, 600}, 1.0f}, std::pair{VkExtent2D{1280, 720}, 1.0f},
        std::pair{VkExtent2D{1920, 1080}, 1.0f}, std::pair{VkExtent2D{3840, 2160}, 2.0f}}) {
    SCOPED_TRACE(extent.width);
    const std::string words = words_at(extent, scale);
    for (const char* each :
         {"left", "right", "grip", "imbalance", "thickness", "stiffness", "grip force [N]", "load [N]"})
      EXPECT_TRUE(says(words, each)) << each << " in " << words;
    EXPECT_TRUE(says(words, text("%.3f N", shown.grip->grip->force_N.value))) << words;
  }
  // One that gives no frames says why in its place, and the other goes on.
  shown.fingers[1] = {.frame = nullptr,
                      .touch = nullptr,
                      .result = nullptr,
                      .tared = {},
                      .state = "camera unplugged; waiting"};
  shown.grip = GripFrame{};
  shown.failed = "the disk is full";
  const std::string words = words_at({1280, 720}, 1);
  for (const char* each : {"camera unplugged", "one finger alone", "RECORDING FAILED", "59.7/s"})
    EXPECT_TRUE(says(words, each)) << each << " in " << words;
}

/// On the display that there is: tests/run starts a virtual one.
TEST(PairWindowTest, ADeviceThatIsLostIsOpenedAnewBehindTheWindow) {
  if (!display_available()) GTEST_SKIP() << "no display";
  gpu::ContextOptions options;
  options.validation = true;
  options.presentation = true;
  options.instance_extensions = window_extensions();
  gpu::Context context(options);
  const RunWatch watch;
  std::array<RunSettings, 2> settings;
  for (const Side side : kSides) {
    settings[index(side)].input = finger(side);
    settings[index(side)].close_at_end = true;
  }
  std::array<OpenFinger, 2> fingers = {OpenFinger(settings[0], false, watch),
                                       OpenFinger(settings[1], false, watch)};
  int thrown = 0;
  for (OpenFinger& one : fingers) one.live.unpaced = false;
  fingers[0].live.on_result = [&thrown](const Touch& touch) {
    if ((touch.sequence > 60 && thrown == 0) || (touch.sequence > 150 && thrown == 1)) {
      ++thrown;
      throw DeviceLost("a device", "none", "the test");
    }
  };
  PairWindowRun run;
  run.window.width = 640;
  run.window.height = 480;
  for (size_t i = 0; i < 2; ++i) run.sensors[i] = fingers[i].found.sensor;
  PairReport report;
  {
    PairWindow window(context, run);
    PairOptions pair;
    pair.viewer = &window;
    pair.period_s = 1. / 60;
    pair.on_pair = [&window](const Matched<FingerTouch>& one) { window.add(one); };
    report = run_pair(context, {fingers[0].pair(), fingers[1].pair()}, pair);
  }
  EXPECT_EQ(thrown, 2);
  for (const LiveReport& one : report.fingers) {
    EXPECT_EQ(one.device_losses, 2u);
    EXPECT_GT(one.shown, 0u);
    EXPECT_EQ(one.captured, 360u);
  }
  for (const std::string& message : context.validation_messages()) ADD_FAILURE() << message;
}

}  // namespace
}  // namespace viz

TEST_F(WindowTest, TwoFingersAreRecordedZeroedAndMarked) {
  open({"live", "--left", "synthetic:grip?size=160x120&side=left&repeat=0", "--right",
        "synthetic:grip?size=160x120&side=right&repeat=0", "--out", folder_ / "out", "--record"});
  ASSERT_TRUE(titled("palpate: two fingers"));
  // The recording from the start is ended by W, and the next one begun.
  const auto sessions = [&] {
    std::vector<fs::path> found;
    if (fs::exists(folder_ / "out"))
      for (const auto& entry : fs::directory_iterator(folder_ / "out"))
        if (is_pair_session(entry.path())) found.push_back(entry.path());
    std::ranges::sort(found);
    return found;
  };
  ASSERT_TRUE(
      wait_for([&] { return sessions().size() == 1 && slurp(sessions()[0] / "pairs.csv").size() > 4000; }));
  desktop_->key("m");
  EXPECT_TRUE(wait_for([&] { return contains(slurp(sessions()[0] / "events.csv"), ",mark,1"); }));
  desktop_->key("w");
  EXPECT_TRUE(wait_for([&] { return read_pair_info(sessions()[0]).complete; }));
  ASSERT_TRUE(wait_for([&] {
    desktop_->key("s");
    return fs::exists(folder_ / "out" / "palpate-0001-right.csv");
  }));
  for (const char* file : {"palpate-0001.png", "palpate-0001-left-frame.png", "palpate-0001-left-depth.tif"})
    EXPECT_TRUE(exists(folder_ / "out" / file)) << file;
  // Zero while both pads touch; the keys of what it does not have do nothing.
  EXPECT_TRUE(wait_for([&] {
    desktop_->key("z");
    return contains(slurp(folder_ / "out" / "events.csv"), ",zero,left force_N=");
  }));
  desktop_->key("shift+z x i ctrl+k h Escape u o");
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_TRUE(contains(done.out, "pairs, skew")) << done.out;
  EXPECT_EQ(remembered()["light_theme"], true);
  EXPECT_EQ(remembered()["colour_map"], "cividis");
  EXPECT_EQ(remembered()["section"], false);
  // What was recorded is a pair like any other.
  const Ended again = this->run({"process", sessions()[0], "--out", folder_ / "again"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
  Table(slurp(folder_ / "again" / "pairs.csv")).expect_whole();
  // And is shown again.
  open({"live", sessions()[0], "--close"});
  EXPECT_TRUE(titled("palpate: two fingers"));
  const Ended shown = ended();
  EXPECT_EQ(shown.exit_code, 0) << shown.err;
}

}  // namespace palpate
