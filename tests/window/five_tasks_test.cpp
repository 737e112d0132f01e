// Five tasks of a new user in the real window: each within four keys or clicks, and the words that lead to
// each are on the screen.
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "capture/run/compare/compare_recordings.h"
#include "capture/synthetic/synthetic.h"
#include "tests/support/gpu_fixture.h"
#include "tests/window/desktop.h"
#include "tests/window/letters.h"
#include "viz/display/compare_view.h"
#include "viz/panels/actions/tool_bar.h"
#include "viz/panels/hud.h"
#include "viz/panels/player/player_bar.h"
#include "viz/render/format.h"

namespace palpate {
namespace {

/// Counts what the person does.
class FiveTasks : public WindowTest {
 protected:
  static constexpr int kMostActions = 4;

  void key(const std::string& keys) {
    ++actions_;
    desktop_->key(keys);
  }
  void click(int x, int y) {
    ++actions_;
    desktop_->click(x, y);
  }
  void TearDown() override {
    EXPECT_LE(actions_, kMostActions);
    WindowTest::TearDown();
  }
  fs::path press(const std::string& name, const std::string& force) {
    fs::path rec = folder_ / name;
    EXPECT_EQ(run({"record", "synthetic:press?size=160x120&force=" + force, "--out", rec, "--frames", "150"})
                  .exit_code,
              0);
    return rec;
  }
  void expect_end() {
    const Ended done = quit();
    EXPECT_EQ(done.exit_code, 0) << done.err;
  }
  /// The folder that holds a file of this name, below the home.
  fs::path found(const std::string& name) const {
    std::error_code code;
    for (const auto& entry : fs::recursive_directory_iterator(home(), code))
      if (entry.path().filename() == name) return entry.path().parent_path();
    return {};
  }

  int actions_ = 0;
};

TEST_F(FiveTasks, SeeACameraLiveAndRecordIt) {
  open({});
  ASSERT_TRUE(titled("^palpate$"));
  Desktop::rest();
  key("Return");  // the first card: a camera, else a simulated one
  ASSERT_TRUE(titled("palpate: "));
  key("w");
  ASSERT_TRUE(wait_for([&] {
    const fs::path session = found("frames.csv");
    const std::string rows = session.empty() ? "" : slurp(session / "frames.csv");
    return std::count(rows.begin(), rows.end(), '\n') > 30;
  }));
  key("w");
  expect_end();
  const Ended again = run({"process", found("frames.csv"), "--out", folder_ / "again", "--as-recorded"});
  EXPECT_EQ(again.exit_code, 0) << again.err;
}

TEST_F(FiveTasks, ReadTheLargestForceAndWhen) {
  open({"replay", press("rec", "0.9"), "--out", folder_ / "out", "--jsonl"});
  ASSERT_TRUE(titled("palpate: "));
  std::map<double, double> force_N;  // by time
  ASSERT_TRUE(wait_for([&] {
    std::istringstream rows(slurp(folder_ / "stdout"));
    for (std::string row; std::getline(rows, row);)
      if (const Json touch = parse_json(row); touch.is_object() && touch["force_N"].is_number())
        force_N[touch["time_s"]] = touch["force_N"];
    return !force_N.empty() && force_N.rbegin()->first > 4.9;
  }));
  key("shift+f");
  key("s");
  ASSERT_TRUE(exists(folder_ / "out" / "palpate-0001.csv"));
  const Table row(slurp(folder_ / "out" / "palpate-0001.csv"));
  const auto largest = std::ranges::max_element(force_N, {}, [](const auto& one) { return one.second; });
  EXPECT_NEAR(largest->second, 0.9, 0.05);
  EXPECT_NEAR(std::stod(row.at(0, "force_N")), largest->second, 0.03 * largest->second);
  expect_end();
}

TEST_F(FiveTasks, CompareTwoPresses) {
  open({"compare", press("soft", "0.6"), press("hard", "0.9")});
  ASSERT_TRUE(titled("palpate: "));
  Desktop::rest();
  key("s");
  const fs::path out = home() / "palpate" / "comparison";
  ASSERT_TRUE(exists(out / "comparison.csv"));
  const Table table(slurp(out / "comparison.csv"));
  EXPECT_NEAR(std::stod(table.at(0, "difference")), 0.3, 4 * std::stod(table.at(0, "difference_sd")));
  EXPECT_EQ(cv::imread(out / "comparison.png").cols, 1280);
  desktop_->key("space a bracketright shift+bracketleft BackSpace o u h Escape");
  desktop_->click(640, 600);
  expect_end();
  EXPECT_EQ(remembered()["light_theme"], true);
  EXPECT_EQ(remembered()["colour_map"], "cividis");
}

TEST_F(FiveTasks, SendTheDepthOfOneMoment) {
  open({"replay", press("rec", "0.9"), "--out", folder_ / "out", "--loop"});
  ASSERT_TRUE(titled("palpate: "));
  Desktop::rest();
  const viz::Layout layout =
      viz::make_layout({1280, 720}, 1, {160, 120, 1, 8}, true, {.player = true, .tools = true});
  key("space");
  click(layout.strip.x + static_cast<int>(layout.strip.width * 0.85), layout.strip.y + 16);
  Desktop::rest();
  Desktop::rest();
  key("s");
  const fs::path stem = folder_ / "out" / "palpate-0001";
  ASSERT_TRUE(exists(stem.string() + ".csv"));
  const double depth_mm = std::stod(Table(slurp(stem.string() + ".csv")).at(0, "depth_max_mm"));
  const cv::Mat depth_um = cv::imread(stem.string() + "-depth.tif", cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth_um.type(), CV_16SC1);
  double most = 0;
  cv::minMaxLoc(depth_um, nullptr, &most);
  EXPECT_GT(depth_mm, 0.2);
  EXPECT_NEAR(1e-3 * most, depth_mm, 0.0015 + 0.01 * depth_mm);
  expect_end();
}

}  // namespace

namespace viz {
namespace {

/// The words of the states that the tasks pass through.
class TaskWords : public GpuTest {
 protected:
  std::string window(bool player) {
    const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:press"));
    HudFrame frame(context(), pass_, 1, nullptr, 1);
    Frame image;
    image.reshape({640, 480, 1, 8});
    LiveStats live;
    if (player) live.player = PlayerStats{.name = "", .frames = 60, .position = 30};
    const Layout layout = make_layout({1280, 720}, 1, image.format, false, {.player = player, .tools = true});
    ViewState state;
    state.fit_to(sensor);
    Hud hud;
    hud.set_timeline({.timed = true, .frames = player ? 60u : 0u, .rate_Hz = 10});
    Touch touch;
    touch.contact = true;
    for (uint64_t i = 0; i < 60; ++i) {
      touch.time_ns = static_cast<int64_t>(i) * 100'000'000;
      touch.force_N = {i == 42 ? 1.234 : 0.5, 0.01, Validity::Valid};
      hud.follow(touch, i);
    }
    const HudContent content{sensor, image, touch, false, &live, "a device", {96, 72}};
    for (int i = 0; i < 3; ++i) {
      frame.begin({1280, 720});
      hud.describe(frame, layout, {1280, 720}, content, state, nullptr, {}, nullptr);
      tool_bar(layout, 1, false, &live, state);
      if (player) player_bar(layout, 1, *live.player, touch.time_ns, hud.history(), state);
      ImGui::Render();
    }
    return words_of(letters_of(*ImGui::GetDrawData()));
  }

  RenderPass pass_{context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                   VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
};

TEST_F(TaskWords, LeadToTheNextAction) {
  const auto expect = [](const std::string& words, std::initializer_list<const char*> wanted) {
    for (const char* each : wanted) EXPECT_TRUE(says(words, each)) << each << " in " << words;
  };
  expect(window(false), {"Record", "Snapshot", "Find", "Help"});
  expect(window(true), {"Snapshot", "Pause", "largest 1.234", "at 4.20 s", "frame 31 of 60"});
}

TEST_F(TaskWords, OfAComparisonAreWholeAndSayTheAnswer) {
  RecordingCurve a;
  a.input = "/a/rather/long/folder/of/recordings/with/the/first/press";
  a.sensor.pitch_mm_per_px = 0.05;
  a.rate_Hz = 10;
  a.width = a.height = 4;
  a.maps.assign(16, 300);
  a.has_depth = true;
  for (int i = 0; i < 40; ++i)
    a.points.push_back({0.1 * i,
                        i > 10,
                        {i > 10 ? 0.8 : 0, 0.01, i > 10 ? Validity::Valid : Validity::NoContact},
                        {0.3, 0.004, Validity::Valid},
                        12});
  RecordingCurve b = a;
  b.input = "synthetic:press";
  for (CurvePoint& point : b.points) point.force_N.value *= 1.5;
  for (const auto& [extent, scale] :
       {std::pair{VkExtent2D{800, 600}, 1.0f}, std::pair{VkExtent2D{1280, 720}, 1.0f},
        std::pair{VkExtent2D{1920, 1080}, 1.0f}, std::pair{VkExtent2D{3840, 2160}, 2.0f}}) {
    SCOPED_TRACE(extent.width);
    OffscreenTarget target(context(), pass_, extent);
    CompareView view(context(), pass_, 1, nullptr, scale, a, b);
    CompareState state{.alignment = Alignment::Touch};
    target.begin();
    view.record(target.cmd(), extent, state, {}, [&] { target.begin_pass(); });
    const std::vector<Letter> letters = letters_of(*ImGui::GetDrawData());
    target.finish();
    EXPECT_EQ(fault_of(letters, scale), "");
    const std::string words = words_of(letters);
    for (const char* each :
         {"B presses 0.400", "harder (+50 %)", "B - A", "aligned by the first touch", "depth"})
      EXPECT_TRUE(says(words, each)) << each << " in " << words;
  }
}

}  // namespace
}  // namespace viz
}  // namespace palpate
