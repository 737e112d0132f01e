// The charts in use: time by wheel and drag, their menu, and what it saves; and without a window, by the
// mouse that ImGui knows.
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "capture/synthetic/synthetic.h"
#include "tests/support/gpu_fixture.h"
#include "tests/window/desktop.h"
#include "viz/panels/actions/actions.h"
#include "viz/panels/charts/chart_table.h"
#include "viz/panels/charts/charts.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/hud_frame.h"
#include "viz/render/layout.h"

namespace palpate {
namespace {

TEST_F(WindowTest, ChartsAreZoomedPannedAndSaved) {
  const fs::path rec = folder_ / "rec", out = folder_ / "out";
  ASSERT_EQ(run({"record", "synthetic:slide?size=160x120", "--out", rec, "--frames", "120"}).exit_code, 0);
  open({"replay", rec, "--out", out});
  ASSERT_TRUE(drawn(out));
  const viz::Layout layout =
      viz::make_layout({1280, 720}, 1, {160, 120, 1, 8}, true, {.player = true, .tools = true});
  const viz::ViewRect& charts = layout.charts;
  const int x = charts.x + static_cast<int>(charts.width) / 2,
            y = charts.y + static_cast<int>(charts.height) / 2;
  int saved = 0;
  /// Times of the table that Shift + S writes, beside a picture of the charts.
  const auto saved_times = [&] {
    desktop_->key("shift+s");
    const std::string stem = (out / text("charts-%04d", ++saved)).string();
    EXPECT_TRUE(exists(stem + ".csv") && exists(stem + ".png"));
    const cv::Mat picture = cv::imread(stem + ".png");
    EXPECT_EQ(picture.cols, static_cast<int>(charts.width));
    EXPECT_EQ(picture.rows, static_cast<int>(charts.height));
    const Table table(slurp(stem + ".csv"));
    table.expect_whole();
    std::vector<double> times;
    for (size_t i = 0; i < table.rows.size(); ++i) times.push_back(std::stod(table.at(i, "time_s")));
    return times;
  };
  // The last frame is there: the recording has been played.
  std::vector<double> all;
  ASSERT_TRUE(wait_for([&] { return !(all = saved_times()).empty() && all.back() > 3.9; }));
  EXPECT_LT(all.front(), 1);
  // The wheel halves the time about twice, around the mouse.
  EXPECT_TRUE(desktop_->tool("mousemove " + std::to_string(x) + " " + std::to_string(y)));
  Desktop::rest();
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(desktop_->tool("click 4"));
  Desktop::rest();
  const std::vector<double> zoomed = saved_times();
  ASSERT_GT(zoomed.size(), 2u);
  EXPECT_GT(zoomed.front(), 0.8);
  EXPECT_LT(zoomed.back(), 3.2);
  // What is dragged to the right shows what was before.
  desktop_->drag(x, y, x + 200, y);
  const std::vector<double> panned = saved_times();
  EXPECT_LT(panned.front(), zoomed.front() - 0.1);
  EXPECT_LT(panned.back(), zoomed.back() - 0.1);
  // The menu, by a right click: its last line shows all again.
  EXPECT_TRUE(desktop_->tool("click 3"));
  Desktop::rest();
  desktop_->click(x + 200 - 40, y - 16);
  const std::vector<double> again = saved_times();
  EXPECT_EQ(again.front(), all.front());
  EXPECT_GE(again.size(), all.size());
  // Escape closes an open menu, and the window only then.
  EXPECT_TRUE(desktop_->tool("click 3"));
  Desktop::rest();
  desktop_->key("Escape");
  EXPECT_EQ(saved_times().front(), all.front());
  const Ended done = quit();
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

}  // namespace

namespace viz {
namespace {

class ChartTest : public GpuTest {
 protected:
  void SetUp() override { frame_ = std::make_unique<HudFrame>(context(), pass_, 1, nullptr, 1.0f); }
  /// One picture with the mouse at `at`.
  bool picture(ImVec2 at, bool down = false, float wheel = 0) {
    ImGuiIO& io = ImGui::GetIO();
    io.MousePos = at;
    io.MouseDown[0] = down;
    io.MouseWheel = wheel;
    frame_->begin({1000, 600});
    style_ = {state_.chart_span_s, state_.whole_recording, 1, state_.chart_view};
    const bool taken = mouse_.follow(kCharts, history_, style_, state_);
    frame_->abandon();
    style_ = {state_.chart_span_s, state_.whole_recording, 1, state_.chart_view};
    return taken;
  }
  void fill(const Timeline& timeline, int frames, double step_s, double error_N = 0.01) {
    history_ = History(timeline);
    Touch touch;
    touch.contact = true;
    for (int i = 0; i < frames; ++i) {
      touch.sequence = static_cast<uint64_t>(i);
      touch.time_ns = std::llround(1e9 * step_s * i);
      touch.force_N = {0.5, error_N, Validity::Valid};
      history_.add(touch);
    }
  }
  TimeSpan shown() const { return shown_span(history_, style_); }

  static constexpr ViewRect kCharts{0, 300, 1000, 300};
  inline static const ImVec2 kMiddle{521, 400};  // of the axis
  RenderPass pass_{context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                   VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
  std::unique_ptr<HudFrame> frame_;
  ChartMouse mouse_;
  ChartStyle style_;
  ViewState state_;
  History history_;
};

TEST_F(ChartTest, TheWheelZoomsARecordingAroundTheMouse) {
  fill({true, 1001, 100, 0}, 1001, 0.01);
  EXPECT_FALSE(picture({500, 100})) << "above the charts";
  EXPECT_TRUE(picture(kMiddle));
  EXPECT_NEAR(shown().length, 10, 1e-9);
  picture(kMiddle, false, 1);
  EXPECT_NEAR(shown().length, 8, 1e-9);
  EXPECT_NEAR(shown().end, 9, 1e-6) << "what is under the mouse stays there";
  for (int i = 0; i < 60; ++i) picture(kMiddle, false, 1);
  EXPECT_NEAR(shown().length, 0.05, 1e-9) << "five frames";
  EXPECT_NEAR(shown().end - 0.5 * shown().length, 5, 1e-3);
  for (int i = 0; i < 60; ++i) picture(kMiddle, false, -1);
  EXPECT_FALSE(state_.chart_view);
  EXPECT_NEAR(shown().length, 10, 1e-9);
}

TEST_F(ChartTest, ADragPansAndAClickGoesThere) {
  fill({true, 1001, 100, 0}, 1001, 0.01);
  for (int i = 0; i < 4; ++i) picture(kMiddle, false, 1);
  const TimeSpan before = shown();
  picture(kMiddle, true);
  picture({kMiddle.x + 100, 400}, true);
  picture({kMiddle.x + 100, 400}, false);
  EXPECT_NEAR(shown().length, before.length, 1e-9);
  EXPECT_NEAR(shown().end, before.end - before.length * 100 / 938, 1e-6);
  EXPECT_FALSE(state_.seek_to) << "a drag is no click";
  picture(kMiddle, true);
  picture({kMiddle.x + 900, 400}, true);
  picture({kMiddle.x + 900, 400}, false);
  EXPECT_NEAR(shown().end - shown().length, 0, 1e-9) << "there is nothing before the first frame";
  picture({52, 400}, false);
  for (int i = 0; i < 30; ++i) picture({52, 400}, false);  // no double click with the one before
  picture({52, 400}, true);
  picture({52, 400}, false);
  EXPECT_EQ(state_.seek_to, 0u);
}

TEST_F(ChartTest, OfALiveSessionTheAxisFollowsUntilItIsHeld) {
  fill({}, 600, 0.1);
  picture(kMiddle);
  EXPECT_NEAR(shown().end, 59.9, 1e-6);
  picture(kMiddle, false, -1);
  EXPECT_NEAR(state_.chart_span_s, 12.5, 1e-6);
  EXPECT_FALSE(state_.chart_view) << "it goes on following";
  picture(kMiddle, true);
  picture({kMiddle.x + 200, 400}, true);
  picture({kMiddle.x + 200, 400}, false);
  ASSERT_TRUE(state_.chart_view);
  const double held = shown().end;
  EXPECT_NEAR(held, 59.9 - 12.5 * 200 / 938, 1e-6);
  picture(kMiddle, true);
  picture({kMiddle.x - 400, 400}, true);
  picture({kMiddle.x - 400, 400}, false);
  EXPECT_FALSE(state_.chart_view) << "back at the present";
  state_.chart_view = TimeSpan{20, 5};
  state_.change_chart_span(1);
  EXPECT_FALSE(state_.chart_view);
}

TEST_F(ChartTest, KeysReadZoomAndPanAsTheMouseDoes) {
  fill({true, 1001, 100, 0}, 1001, 0.01);
  const auto press = [&](const KeyPress& key) {
    const Action* action = action_of(key, {.player = true});
    ASSERT_NE(action, nullptr);
    action->run(state_);
    follow_chart_keys(history_, style_, state_);
    picture({500, 100});
  };
  picture({500, 100});
  for (int i = 0; i < 50; ++i) press({GLFW_KEY_COMMA, true});
  ASSERT_TRUE(state_.chart_cursor);
  EXPECT_NEAR(*state_.chart_cursor, 5, 1e-6) << "from the newest value, by hundredths";
  press({GLFW_KEY_LEFT_BRACKET, true});
  EXPECT_NEAR(shown().length, 8, 1e-9);
  EXPECT_NEAR(shown().end, 9, 1e-6) << "the cursor stays where it is";
  press({GLFW_KEY_LEFT_BRACKET, false, true});
  EXPECT_NEAR(shown().end, 9 - 0.2 * 8 + 0.6, 1e-6) << "there is nothing before the first frame";
  press({GLFW_KEY_RIGHT_BRACKET, false, true});
  EXPECT_NEAR(shown().end, 8 + 0.2 * 8, 1e-6);
  for (int i = 0; i < 90; ++i) press({GLFW_KEY_PERIOD, true});
  EXPECT_NEAR(*state_.chart_cursor, shown().end, 1e-6) << "it does not leave what is shown";
  press({GLFW_KEY_RIGHT_BRACKET, true});
  EXPECT_FALSE(state_.chart_view);
  press({GLFW_KEY_LEFT_BRACKET, true});
  press({'P', true});
  EXPECT_NEAR(shown().length, 10, 1e-9);
  // The line stands at a value; the mouse takes it away when it moves over the charts, Escape at once.
  style_.cursor = 5.003;
  std::set<int> columns;
  frame_->begin({1000, 600});
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const int from = list->VtxBuffer.Size;
  draw_strip_charts(list, kCharts, history_, {}, {}, style_);
  for (int i = from; i < list->VtxBuffer.Size; ++i)
    if (list->VtxBuffer[i].col == ink(theme().text) && std::abs(list->VtxBuffer[i].pos.x - kMiddle.x) < 1)
      columns.insert(static_cast<int>(list->VtxBuffer[i].pos.x));
  frame_->abandon();
  EXPECT_FALSE(columns.empty());
  picture({600, 450});
  picture({610, 450});
  EXPECT_FALSE(state_.chart_cursor);
  press({GLFW_KEY_COMMA, true});
  press({GLFW_KEY_ESCAPE});
  EXPECT_FALSE(state_.chart_cursor || state_.close_requested);
}

/// Rows between the highest and the lowest of what is drawn in a colour within the first chart.
TEST_F(ChartTest, NoAxisIsShorterThanSixStandardErrors) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  for (const double error_N : {0.001, 0.05, 0.4, 3.0}) {
    fill({}, 100, 0.1, error_N);
    frame_->begin({1000, 600});
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    const int from = list->VtxBuffer.Size;
    draw_strip_charts(list, kCharts, history_, sensor, {}, {.span_s = 10});
    float top = 1e9f, foot = 0, frame_top = 1e9f, frame_foot = 0;
    for (int i = from; i < list->VtxBuffer.Size; ++i) {
      const ImDrawVert& v = list->VtxBuffer[i];
      if (v.pos.y > 400) continue;  // of the charts below
      if (v.col == ink(theme().chosen, 70)) top = std::min(top, v.pos.y), foot = std::max(foot, v.pos.y);
      if (v.col == ink(theme().chart))
        frame_top = std::min(frame_top, v.pos.y), frame_foot = std::max(frame_foot, v.pos.y);
    }
    frame_->abandon();
    ASSERT_LT(top, foot) << error_N;
    // The band is four standard errors high.
    EXPECT_LE((foot - top) / (frame_foot - frame_top), 4.0f / 6 + 0.01f) << error_N;
  }
}

TEST(Charts, TheLargestIsKnownAndWithinWhatIsShown) {
  std::deque<Sample> samples;
  for (int i = 0; i < 10; ++i) {
    Sample s;
    s.time = i;
    s.contact = i > 0;
    s.force_N = {i == 0 ? 99.0 : i, 0.1,
                 i == 9   ? Validity::NotCalibrated
                 : i == 8 ? Validity::AtBorder
                          : Validity::Valid};
    samples.push_back(s);
  }
  const auto largest_at = [&](const TimeSpan& shown) {
    const Sample* largest = largest_of(samples, shown, [](const Sample& s) { return s.force_N; });
    return largest ? largest->time : -1;
  };
  EXPECT_EQ(largest_at({10, 10}), 8) << "in doubt, but neither without a contact nor unknown";
  EXPECT_EQ(largest_at({5.5, 3}), 5);
  EXPECT_EQ(largest_at({0.5, 1}), -1);
}

TEST_F(ChartTest, TheTableHasWhatIsShown) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  fill({}, 100, 0.1);
  history_.mark({31, 3.1, "mark", "pressed, hard"});
  const std::string table = chart_table(history_, {4.0, 2.0}, sensor);
  EXPECT_EQ(
      table.substr(0, table.find('\n')),
      "time_s,force_N,force_sd_N,force_state,shear_x_N,shear_x_sd_N,shear_y_N,shear_y_sd_N,shear_state,slip,"
      "depth_max_mm,depth_sd_mm,gray_sum,event");
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 1 + 21);
  EXPECT_NE(table.find("\n3.1,0.5,0.01,valid,,,,,not calibrated,not calibrated,,,0,\"pressed, hard\"\n"),
            std::string::npos)
      << table;
}

}  // namespace
}  // namespace viz
}  // namespace palpate
