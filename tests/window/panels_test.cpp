// Panels as they are described to ImGui, without a window: words that have room, words that lie over nothing,
// and what is said of a pad at rest.
#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "capture/synthetic/synthetic.h"
#include "engine/measure/quantities.h"
#include "tests/support/gpu_fixture.h"
#include "viz/panels/actions/help.h"
#include "viz/panels/actions/palette.h"
#include "viz/panels/actions/tool_bar.h"
#include "viz/panels/charts/chart.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/controls.h"
#include "viz/panels/hud.h"
#include "viz/panels/numbers/measurement.h"
#include "viz/panels/numbers/performance.h"
#include "viz/panels/numbers/press.h"
#include "viz/panels/run_panel.h"
#include "viz/panels/start/card_grid.h"
#include "viz/render/annotations.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/hud_frame.h"

namespace palpate::viz {
namespace {

class PanelTest : public GpuTest {
 protected:
  /// Describes pictures one after the other: a window has its size from the second on.
  void describe(float scale, const std::function<void()>& content, VkExtent2D extent = {1280, 720}) {
    if (!frame_ || frame_->scale() != scale) {
      frame_.reset();
      frame_ = std::make_unique<HudFrame>(context(), pass_, 1, nullptr, scale);
    }
    for (int i = 0; i < 3; ++i) {
      frame_->begin(extent);
      content();
      frame_->abandon();
    }
  }
  /// All words that ImGui writes while `content` is described, in their order.
  std::string words_of(const std::function<void()>& content) {
    static std::string copied;
    copied.clear();
    describe(1, [&] {
      ImGui::GetIO().SetClipboardTextFn = [](void*, const char* text) { copied = text; };
      ImGui::LogToClipboard();
      content();
    });
    return copied;
  }
  static size_t count(const std::string& words, const std::string& what) {
    size_t found = 0;
    for (size_t at = words.find(what); at != std::string::npos; at = words.find(what, at + 1)) ++found;
    return found;
  }

  RenderPass pass_{context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                   VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
  std::unique_ptr<HudFrame> frame_;
};

TEST_F(PanelTest, EveryButtonHasRoomWhateverItSays) {
  for (const float scale : {1.0f, 1.6f, 0.6f})
    for (int variant = 0; variant < 32; ++variant) {
      SCOPED_TRACE(text("variant %d at %g", variant, static_cast<double>(scale)));
      ViewState state;
      state.tare.on = variant & 1;
      state.paused = variant & 2;
      LiveStats live;
      live.notes = "/a/folder";
      live.recording = variant & 4;
      live.from_list = variant & 8;
      if (variant & 16) live.player = PlayerStats{};
      const VkExtent2D extent{static_cast<uint32_t>(1280 * scale), static_cast<uint32_t>(720 * scale)};
      const Layout layout = make_layout(
          extent, scale, {320, 240, 1, 8}, true,
          {.charts = true, .profile = false, .dock = 264, .player = live.player.has_value(), .tools = true});
      ASSERT_TRUE(layout.has_dock);
      describe(
          scale, [&] { control_window(layout, scale, true, &live, state); }, extent);
      const ImGuiWindow* window = ImGui::FindWindowByName("Settings");
      ASSERT_NE(window, nullptr);
      EXPECT_EQ(window->ScrollMax.x, 0) << "pushed out at the right";
      EXPECT_EQ(window->ScrollMax.y, 0) << "pushed out at the foot";
    }
}

TEST_F(PanelTest, TheToolBarHasTheMostWantedActionsThatFit) {
  for (const float scale : {1.0f, 1.6f})
    for (const uint32_t width : {480u, 640u, 800u, 1280u, 1920u})
      for (const bool player : {false, true}) {
        SCOPED_TRACE(text("%u px at %g", width, static_cast<double>(scale)));
        ViewState state;
        LiveStats live;
        live.from_list = true;
        if (player) live.player = PlayerStats{};
        const VkExtent2D extent{width, 480};
        const Layout layout = make_layout(extent, scale, {320, 240, 1, 8}, true, {.tools = true});
        describe(
            scale, [&] { tool_bar(layout, scale, true, &live, state); }, extent);
        const ImGuiWindow* bar = ImGui::FindWindowByName("tools");
        ASSERT_NE(bar, nullptr);
        EXPECT_EQ(bar->ScrollMax.x, 0);
        EXPECT_EQ(bar->ScrollMax.y, 0);
        std::vector<BarButton> all;
        describe(
            scale, [&] { all = bar_buttons(layout, scale, true, &live, state); }, extent);
        const auto in_bar = [&](std::string_view label) {
          return std::ranges::any_of(all, [&](const BarButton& b) { return b.in_bar && label == b.label; });
        };
        EXPECT_TRUE(std::ranges::all_of(all, &BarButton::in_bar) || static_cast<float>(width) < 1280 * scale);
        EXPECT_TRUE(in_bar("Settings") || static_cast<float>(width) < 480 * scale);
        EXPECT_TRUE(!in_bar("Text") || in_bar("Snapshot")) << "the wanted ones have the room";
      }
}

TEST_F(PanelTest, AButtonOfTheBarDoesWhatItsKeyDoes) {
  ViewState state;
  LiveStats live;
  const Layout layout = make_layout({1280, 720}, 1, {320, 240, 1, 8}, true, {.tools = true});
  describe(1, [&] {
    for (const BarButton& button : bar_buttons(layout, 1, true, &live, state)) button.action->run(state);
  });
  // Three pictures: what is switched has been switched three times.
  EXPECT_TRUE(state.paused && state.controls && state.help && state.sensor_panel && state.labelling);
  EXPECT_TRUE(state.snapshot_requested && state.mark_requested && state.zero_requested);
  EXPECT_TRUE(state.recording_switched_requested && state.palette);
}

TEST_F(PanelTest, ADoubleClickGoesBackToTheWholeSurfaceOrChangesPlaces) {
  ViewState state;
  state.camera.zoom = 3;
  const auto double_click = [&](ImVec2 at, const Layout& layout) {
    int step = 0;  // pressed and let go twice, then at rest
    const auto picture = [&] {
      ImGuiIO& io = ImGui::GetIO();
      io.MousePos = at;
      io.MouseDown[0] = step < 4 && step % 2 == 0;
      ++step;
      follow_double_click(layout, state);
    };
    describe(1, picture);
    describe(1, picture);
  };
  const auto layout_now = [&] {
    return make_layout({1280, 720}, 1, {320, 240, 1, 8}, true, {.image_large = state.image_large});
  };
  double_click(middle(layout_now().image), layout_now());
  EXPECT_TRUE(state.image_large);
  EXPECT_EQ(state.camera.zoom, 3);
  const ImVec2 inner = corner(layout_now().surface);  // farther away than a third click could be
  double_click({inner.x + 20, inner.y + 20}, layout_now());
  EXPECT_EQ(state.camera.zoom, 1);
  double_click(middle(layout_now().charts), layout_now());
  EXPECT_TRUE(state.image_large);
}

TEST_F(PanelTest, ThePaletteFitsTheWindowAndShowsWhatIsChosen) {
  for (const VkExtent2D extent : {VkExtent2D{480, 360}, VkExtent2D{800, 600}, VkExtent2D{3840, 2160}}) {
    const float scale = extent.width > 3000 ? 2 : 1;
    ViewState state;
    state.palette = true;
    const Circumstances now{.has_surface = true};
    state.found = 1 << 20;  // beyond the last
    describe(
        scale, [&] { palette_window(extent, scale, now, state); }, extent);
    EXPECT_EQ(state.found, static_cast<int>(actions_named("", now).size()) - 1);
    const ImGuiWindow* window = ImGui::FindWindowByName("Find an action or a setting");
    ASSERT_NE(window, nullptr);
    EXPECT_GE(window->Pos.x, 0);
    EXPECT_LE(window->Pos.x + window->Size.x, static_cast<float>(extent.width));
    EXPECT_LE(window->Pos.y + window->Size.y, static_cast<float>(extent.height));
    const ImGuiWindow* list = nullptr;
    for (const ImGuiWindow* w : ImGui::GetCurrentContext()->Windows)
      if (std::string_view(w->Name).find("/found_") != std::string_view::npos) list = w;
    ASSERT_NE(list, nullptr);
    EXPECT_GT(list->ScrollMax.y, 0);
    EXPECT_EQ(list->Scroll.y, list->ScrollMax.y) << "the last one is in sight";
    std::snprintf(state.searched.text.data(), state.searched.text.size(), "no such thing");
    describe(
        scale, [&] { palette_window(extent, scale, now, state); }, extent);
    EXPECT_TRUE(state.palette);
  }
}

TEST_F(PanelTest, CardsFillTheWidthAndAreReachedByArrows) {
  for (const float width : {200.0f, 640.0f, 900.0f, 2400.0f})
    for (const float scale : {1.0f, 1.6f}) {
      const float card = CardGrid::width_for(width, scale);
      const float columns = std::floor((width + 8 * scale) / (card + 8 * scale));
      EXPECT_LE(columns * card + (columns - 1) * 8 * scale, width);
      EXPECT_TRUE(card >= 150 * scale || width < 150 * scale);
      EXPECT_LT(card, 2 * (150 + 8) * scale) << "no room for another";
    }
  CardGrid grid;
  describe(1, [&] {
    ImGui::SetNextWindowSize({700, 1500});
    ImGui::Begin("page");
    grid.begin(*frame_, 640);  // four columns
    grid.heading("first");
    for (int i = 0; i < 6; ++i) grid.add({"card", "detail", {}}, false, false, "");
    grid.heading("second");
    grid.remark("no camera found");
    grid.heading("third");
    for (int i = 0; i < 2; ++i) grid.add({"card", "detail", {}}, false, false, "");
    ImGui::End();
  });
  ASSERT_EQ(grid.size(), 8u);
  EXPECT_EQ(grid.neighbour(0, 1, 0), 1u);
  EXPECT_EQ(grid.neighbour(0, -1, 0), 0u);
  EXPECT_EQ(grid.neighbour(3, 1, 0), 4u) << "on to the next row";
  EXPECT_EQ(grid.neighbour(1, 0, 1), 5u);
  EXPECT_EQ(grid.neighbour(3, 0, 1), 5u) << "the nearest of a shorter row";
  EXPECT_EQ(grid.neighbour(4, 0, 1), 6u) << "over what is no card";
  EXPECT_EQ(grid.neighbour(2, 0, 2), 7u);
  EXPECT_EQ(grid.neighbour(7, 0, 3), 7u);
  EXPECT_EQ(grid.neighbour(7, 0, -9), 1u);
}

TEST_F(PanelTest, ForceByTheLayerHasAChart) {
  Sensor sensor;
  History history;
  Touch touch;
  touch.contact = true;
  touch.traction.emplace().fz_N = {1.0, 0.1, Validity::Valid};
  for (int i = 0; i < 10; ++i) {
    touch.time_ns = i * 1'000'000'000LL;
    history.add(touch);
  }
  // The curve is level, and its band ends a fifth above and below it.
  const auto heights = [&](ImU32 colour) {
    std::set<int> at;
    describe(1, [&] {
      ImDrawList* list = ImGui::GetBackgroundDrawList();
      const int from = list->VtxBuffer.Size;
      draw_strip_charts(list, {0, 0, 600, 200}, history, sensor, {}, {.span_s = 10});
      for (int i = from; i < list->VtxBuffer.Size; ++i)
        if (list->VtxBuffer[i].col == colour && list->VtxBuffer[i].pos.y > 30)
          at.insert(static_cast<int>(std::lround(list->VtxBuffer[i].pos.y)));
    });
    return at;
  };
  const std::set<int> curve = heights(ink(theme().chosen)), band = heights(ink(theme().chosen, 70));
  ASSERT_FALSE(curve.empty() || band.empty());
  EXPECT_LE(*curve.rbegin() - *curve.begin(), 4);
  EXPECT_LT(*band.begin(), *curve.begin());
  EXPECT_GT(*band.rbegin(), *curve.rbegin());
  touch.traction.reset();
  touch.time_ns += 1'000'000'000;
  history.add(touch);
  EXPECT_FALSE(history.samples().back().layer_N);
}

TEST_F(PanelTest, TheHelpLetsNothingShowThroughAndFitsTheWindow) {
  bool open = true;
  for (const VkExtent2D extent : {VkExtent2D{800, 600}, VkExtent2D{1280, 720}}) {
    describe(
        1,
        [&] {
          help_window(extent, 1, key_help({.player = true, .has_surface = true, .section = true}), open);
        },
        extent);
    const ImGuiWindow* window = ImGui::FindWindowByName("Keys and mouse");
    ASSERT_NE(window, nullptr);
    EXPECT_LE(window->Size.x, static_cast<float>(extent.width));
    EXPECT_LE(window->Size.y, static_cast<float>(extent.height));
    // The first rectangle that is filled is the window's own.
    ASSERT_FALSE(window->DrawList->VtxBuffer.empty());
    EXPECT_EQ(window->DrawList->VtxBuffer[0].col >> IM_COL32_A_SHIFT, 255u);
  }
  EXPECT_TRUE(open);
}

/// Whether two of the texts lie over each other.
testing::AssertionResult apart(const std::vector<PlacedText>& texts) {
  for (size_t i = 0; i < texts.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const PlacedText &a = texts[i], &b = texts[j];
      if (a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom)
        return testing::AssertionFailure() << "'" << a.words << "' over '" << b.words << "'";
    }
  return testing::AssertionSuccess();
}

TEST_F(PanelTest, NoLabelOfTheAxesLiesOverAnother) {
  const auto has = [](const std::vector<PlacedText>& texts, const std::string& words) {
    return std::any_of(texts.begin(), texts.end(),
                       [&](const PlacedText& t) { return t.words.rfind(words, 0) == 0; });
  };
  for (const auto& [width, height] : {std::pair{1280u, 720u}, {800u, 600u}, {1920u, 1080u}}) {
    const Layout layout =
        make_layout({width, height}, 1, {320, 240, 1, 8}, true, {.dock = width > 800 ? 264.0 : 0.0});
    describe(1,
             [&] {
               for (const double range_mm : {0.05, 0.5, 1.0, 8.0})
                 for (double elevation = -1.5; elevation < 1.56; elevation += 0.17)
                   for (double azimuth = -3.1; azimuth < 3.2; azimuth += 0.23) {
                     SurfaceStyle style;
                     style.range_mm = range_mm;
                     style.exaggeration = 4.2 / range_mm;
                     Camera camera;
                     const bool default_view = elevation < -1.4 && azimuth < -3;
                     if (!default_view) camera.azimuth_rad = azimuth, camera.elevation_rad = elevation;
                     const Vec3 half = surface_half_size_mm(320, 240, 0.08, style);
                     const Eye eye =
                         place(camera, half, layout.surface.aspect(), margins_of(layout.surface, 1));
                     const std::vector<PlacedText> texts =
                         draw_axes(ImGui::GetBackgroundDrawList(), eye, layout.surface, half, style, 1);
                     ASSERT_TRUE(apart(texts)) << azimuth << " " << elevation << " " << range_mm;
                     if (!default_view) continue;
                     for (const char* words : {"x [mm]", "y [mm]", "depth [mm]", "-10", "0", "5"})
                       EXPECT_TRUE(has(texts, words)) << words;
                     EXPECT_GE(std::count_if(texts.begin(), texts.end(),
                                             [&](const PlacedText& t) {
                                               const double v = std::strtod(t.words.c_str(), nullptr);
                                               return v > 0 && v <= range_mm &&
                                                      t.words.find('x') == std::string::npos;
                                             }),
                               1)
                         << "numbers of depth";
                   }
             },
             {width, height});
  }
}

/// From the smallest to the largest y of what was drawn since `from`.
std::pair<float, float> rows_of(const ImDrawList& list, int from) {
  float low = 1e9f, high = -1e9f;
  for (int i = from; i < list.VtxBuffer.Size; ++i) {
    low = std::min(low, list.VtxBuffer[i].pos.y);
    high = std::max(high, list.VtxBuffer[i].pos.y);
  }
  return {low, high};
}

TEST_F(PanelTest, ArrowsOfPressureEndOnThePadAndAreAsLongAsItIs) {
  constexpr uint32_t kWidth = 22, kHeight = 16;
  std::vector<float> pressure(kWidth * kHeight), along(kWidth * kHeight), across(kWidth * kHeight);
  std::fill_n(pressure.begin(), kWidth, 40.0f);  // far away: a single cell would not set the scale
  pressure[8 * kWidth + 6] = 20;
  pressure[8 * kWidth + 15] = 40;
  along[8 * kWidth + 6] = 30;
  const Layout layout = make_layout({1280, 720}, 1, {320, 240, 1, 8}, true);
  const SurfaceStyle style;
  const Vec3 half = surface_half_size_mm(320, 240, 0.08, style);
  Camera camera;
  camera.azimuth_rad = 0;
  const Eye eye = place(camera, half, layout.surface.aspect(), margins_of(layout.surface, 1));
  const auto on_screen = [&](double column) {
    const Projected p =
        eye.project({(2 * (column + 0.5) / kWidth - 1) * half.x, (1 - 2 * 8.5 / kHeight) * half.y, 0});
    return ImVec2{static_cast<float>(layout.surface.x + p.x * layout.surface.width),
                  static_cast<float>(layout.surface.y + p.y * layout.surface.height)};
  };
  const TractionMaps all{kWidth, kHeight, 16, pressure, along, across};
  /// Left, top, right and foot of what is drawn near a column's place; left above right: nothing.
  const auto drawn = [&](const TractionMaps& maps, TractionArrows arrows, double column) {
    ImVec4 box{1e9f, 1e9f, -1e9f, -1e9f};
    describe(1, [&] {
      ImDrawList* list = ImGui::GetBackgroundDrawList();
      const int from = list->VtxBuffer.Size;
      draw_traction(list, eye, layout.surface, half, maps, arrows, 0, 1);
      for (int i = from; i < list->VtxBuffer.Size; ++i) {
        const ImVec2 at = list->VtxBuffer[i].pos, place = on_screen(column);
        if (std::abs(at.x - place.x) > 60 || std::abs(at.y - place.y) > 120) continue;
        box = {std::min(box.x, at.x), std::min(box.y, at.y), std::max(box.z, at.x), std::max(box.w, at.y)};
      }
    });
    return box;
  };
  const ImVec4 light = drawn(all, TractionArrows::Pressure, 6),
               heavy = drawn(all, TractionArrows::Pressure, 15);
  EXPECT_NEAR(light.w, on_screen(6).y, 3) << "its point";
  EXPECT_NEAR(heavy.w, on_screen(15).y, 3);
  EXPECT_NEAR((on_screen(15).y - heavy.y) / (on_screen(6).y - light.y), 2, 0.2);
  const ImVec4 shear = drawn(all, TractionArrows::Shear, 6);
  EXPECT_NEAR(shear.x, on_screen(6).x, 3) << "it begins at its place";
  EXPECT_GT(shear.z, on_screen(6).x + 10);
  for (const ImVec4& none : {drawn(all, TractionArrows::Shear, 15), drawn(all, TractionArrows::Off, 6),
                             drawn({}, TractionArrows::Pressure, 6),
                             drawn({kWidth, kHeight, 16, pressure, {}, {}}, TractionArrows::Shear, 6)})
    EXPECT_GT(none.x, none.z);
}

TEST_F(PanelTest, WordsOfAChartStandAboveIt) {
  describe(1, [&] {
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    Chart chart(list, {60, 100}, {500, 160}, 10, 10, 1);
    chart.set_range(0, 1);
    const int from = list->VtxBuffer.Size;
    chart.title("force [N]");
    chart.title("a second part");
    chart.note("calibrated to 1.5 N", ink(theme().text));
    ASSERT_GT(list->VtxBuffer.Size, from);
    EXPECT_LE(rows_of(*list, from).second, 100.5f);
    float right = 0;
    for (int i = from; i < list->VtxBuffer.Size; ++i) right = std::max(right, list->VtxBuffer[i].pos.x);
    EXPECT_LE(right, 501);
    // No room: the note gives way, the first words are shortened.
    Chart narrow(list, {60, 100}, {130, 160}, 10, 10, 1);
    narrow.title("gray sum G [1000 gray levels]");
    const int behind = list->VtxBuffer.Size;
    narrow.note("calibrated to 1.5 N", ink(theme().text));
    EXPECT_EQ(list->VtxBuffer.Size, behind);
  });
}

TEST_F(PanelTest, NoLineCrossesAGapAndALoneSampleIsADot) {
  describe(1, [&] {
    ImDrawList* list = ImGui::GetBackgroundDrawList();
    Chart chart(list, {0, 100}, {1000, 200}, 10, 10, 1);
    chart.set_range(0, 1);
    std::deque<Sample> samples;
    for (const double time : {1.0, 1.5, 5.0, 8.0, 8.5}) {
      Sample s;
      s.time = time;
      s.gap = time == 1.0 || time == 5.0 || time == 8.0;
      samples.push_back(s);
    }
    const int from = list->VtxBuffer.Size;
    chart.line(
        samples, [](const Sample&) { return std::optional(0.5); }, ink(theme().text), LineStyle::Solid);
    int near_dot = 0;
    for (int i = from; i < list->VtxBuffer.Size; ++i) {
      const float x = list->VtxBuffer[i].pos.x;
      near_dot += std::abs(x - 500) < 5;
      EXPECT_TRUE(x < 155 || std::abs(x - 500) < 5 || x > 795) << x;
    }
    EXPECT_GT(near_dot, 0);
  });
}

TEST_F(PanelTest, APadAtRestSaysSoOnce) {
  const SyntheticOptions options = parse_synthetic("synthetic:slide?size=320x240");
  const Sensor sensor = synthetic_sensor(options);
  Frame image;
  image.reshape({320, 240, 1, 8});
  Touch touch;
  touch.force_N.validity = touch.shear_x_N.validity = touch.shear_y_N.validity = Validity::NoContact;
  touch.slip = Slip::NoContact;
  touch.surface.emplace().depth_max_mm = 0.004;
  touch.surface->validity = Validity::NoContact;
  touch.regions.emplace();
  const Layout layout = make_layout({1280, 720}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const std::string words =
      words_of([&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); });
  EXPECT_EQ(count(words, "no contact"), 1u) << words;
  EXPECT_EQ(count(words, "nothing touches"), 0u) << words;
  EXPECT_EQ(count(words, "gel"), 0u) << "a waveguide: " << words;
  EXPECT_NE(words.find("uneven by 0.004 mm"), std::string::npos) << words;
  EXPECT_EQ(count(words, "calibrated"), 1u) << "its range: " << words;
  // Nor does a calibration that is not fit for use look like one that is.
  Sensor unfit = sensor;
  unfit.force->fit_for_use = false;
  const HudContent other{unfit, image, touch, true, nullptr, "device", {96, 72}};
  const std::string warned = words_of([&] { measurement_panel(*frame_, layout, other, touch, ViewState{}); });
  EXPECT_NE(warned.find("NOT FIT FOR USE"), std::string::npos) << warned;
}

// Without a force curve there is no calibrated range that a force could be within.
TEST_F(PanelTest, AForceByTheLayerIsNotCalledWithinCalibration) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  sensor.force.reset();
  Frame image;
  image.reshape({320, 240, 1, 8});
  Touch touch;
  touch.contact = true;
  touch.force_N.validity = Validity::NotCalibrated;
  touch.traction.emplace().fz_N = {2, 0.3, Validity::Valid};
  const Layout layout = make_layout({1280, 720}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const auto words = [&] {
    return words_of([&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); });
  };
  const std::string valid = words();
  EXPECT_EQ(valid.find("within calibration"), std::string::npos) << valid;
  touch.traction->fz_N.validity = Validity::AtBorder;
  const std::string cut = words();
  EXPECT_NE(cut.find("BORDER"), std::string::npos) << cut;
}

TEST_F(PanelTest, EachQuantityOfTheListHasItsRow) {
  const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({320, 240, 1, 8});
  constexpr Estimate kKnown{0.5, 0.1, Validity::TooDeep};
  Touch touch;
  touch.contact = true;
  touch.slip = Slip::Stick;
  touch.shear_x_N = touch.shear_y_N = kKnown;
  SurfaceSummary& surface = touch.surface.emplace();
  surface.volume_mm3 = 1;
  surface.dented_mm2 = 2;
  surface.clipped_px = 3;
  surface.extrapolated_px = 4;
  surface.weighted = {0.1, 0.1, 2, 1};
  touch.confidence.emplace();
  touch.regions = {0, true};
  touch.contacts.resize(1);
  touch.skin = {10, 2, 5, kKnown, kKnown, kKnown, kKnown};
  touch.light = {LightState::Changed, 1.5};
  TractionSummary& traction = touch.traction.emplace();
  traction.fx_N = traction.fy_N = traction.fz_N = kKnown;
  traction.mx_Nmm = traction.my_Nmm = traction.mz_Nmm = kKnown;
  traction.slipping_fraction = 0.25;
  ObjectPose& object = touch.object.emplace();
  object.state = PoseState::Tracked;
  object.doubt = PoseDoubt::OthersMove;
  object.surface = Slippage::Ball;
  object.shift_mm.fill(kKnown);
  object.turn_rad.fill(kKnown);
  object.on_skin = OnSkin::Slips;
  object.slip_mm.fill(kKnown);
  const Layout layout = make_layout({1280, 1600}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const std::string words =
      words_of([&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); });
  for (const MeasuredQuantity<Touch>& q : touch_quantities())
    EXPECT_NE(words.find(q.row.label), std::string::npos) << q.name << ": " << words;
  for (const char* row : {"0.50, 0.50, 0.50 N", "+28.65 \xc2\xb1 5.73 deg", "25 % of the area"})
    EXPECT_NE(words.find(row), std::string::npos) << row << ": " << words;
  EXPECT_EQ(count(words, "stick or slip"), 1u) << words;
}

TEST_F(PanelTest, NoRowOfATouchIsCutOffAtTheFoot) {
  const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({640, 480, 3, 8});
  constexpr Estimate kKnown{0.5, 0.1, Validity::Valid};
  Touch touch;  // of a gel with markers and a layer
  touch.contact = true;
  touch.slip = Slip::Stick;
  touch.force_N = touch.shear_x_N = touch.shear_y_N = kKnown;
  touch.surface.emplace().volume_mm3 = 1;
  touch.surface->dented_mm2 = 2;
  touch.regions = {0, true};
  touch.contacts.resize(1);
  touch.skin = {10, 2, 5, kKnown, kKnown, kKnown, kKnown};
  TractionSummary& traction = touch.traction.emplace();
  traction.fx_N = traction.fy_N = traction.fz_N = kKnown;
  traction.mx_Nmm = traction.my_Nmm = traction.mz_Nmm = kKnown;
  const HudContent content{sensor, image, touch, true, nullptr, "device", {96, 72}};
  const auto fits = [&](VkExtent2D extent) {
    SCOPED_TRACE(text("%u x %u", extent.width, extent.height));
    const Layout layout = make_layout(extent, 1, image.format, true);
    describe(
        1, [&] { measurement_panel(*frame_, layout, content, touch, ViewState{}); }, extent);
    const auto& windows = ImGui::GetCurrentContext()->Windows;
    const auto* const numbers = std::find_if(windows.begin(), windows.end(), [](const ImGuiWindow* w) {
      return std::string_view(w->Name).find("/numbers_") != std::string_view::npos;
    });
    ASSERT_NE(numbers, windows.end());
    EXPECT_GT((*numbers)->ContentSize.y, 320) << "rows of everything";
    EXPECT_EQ((*numbers)->ScrollMax.y, 0);
  };
  fits({1280, 720});
  fits({1920, 1080});
  // What a colour gel by weights adds to them: smaller letters.
  touch.surface->clipped_px = 3;
  touch.surface->extrapolated_px = 4;
  touch.surface->weighted = {0.1, 0.1, 2, 1};
  touch.confidence.emplace();
  touch.light = {LightState::Changed, 1.5};
  fits({1280, 720});
}

TEST_F(PanelTest, RatesAndLatencyAreBehindAKey) {
  const Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  Frame image;
  image.reshape({320, 240, 1, 8});
  const Touch touch;
  LiveStats live;
  live.to_measured = live.to_shown = {1, 2, 3, 10};
  live.dropped_before_engine = 7;
  live.recent = {{10, 20, 5}, {12, 30, 8}};
  const Layout layout = make_layout({1280, 720}, 1, image.format, true);
  const HudContent content{sensor, image, touch, true, &live, "device", {96, 72}};
  ViewState state;
  Hud hud;
  const auto shown = [&] {
    describe(1, [&] { hud.describe(*frame_, layout, {1280, 720}, content, state, nullptr, {}, nullptr); });
    const ImGuiWindow* overlay = ImGui::FindWindowByName("performance");
    return overlay && overlay->Active;
  };
  EXPECT_FALSE(shown());
  state.rates = true;
  EXPECT_TRUE(shown());
  const std::string words = words_of([&] { performance_overlay(layout, content, 1); });
  for (const char* said : {"to measured 1.0 / 2.0 / 3.0 ms", "7 not measured", "mesh 96 x 72"})
    EXPECT_EQ(count(words, said), 1u) << said << " in " << words;
}

TEST(StripCharts, ShearDoesNotShowTheNoiseOfAPadAtRest) {
  Sensor sensor = synthetic_sensor(parse_synthetic("synthetic:slide?size=320x240"));
  const double largest_N = calibrated_range(*sensor.force).most_N;
  std::deque<Sample> samples(1);
  EXPECT_NEAR(least_shear_axis_N(sensor, samples), 0.05 * sensor.shear->friction * largest_N, 1e-12);
  samples[0].contact = true;
  samples[0].shear_x_N = {0.001, 0.2, Validity::Valid};
  EXPECT_NEAR(least_shear_axis_N(sensor, samples), 0.8, 1e-12) << "four standard errors";
  samples[0].shear_x_N.validity = Validity::NotCalibrated;
  EXPECT_LT(least_shear_axis_N(sensor, samples), 0.1);
}

TEST(PressRows, APressInProgressSaysHowManyLoadsItHas) {
  PressStatus status;
  status.pressing = true;
  status.force_N = 0.8;
  status.loads = 2;
  status.wanted = 4;
  const auto says = [&](const char* name, const char* value) {
    return std::ranges::any_of(press_rows(status, 0),
                               [&](const PressRow& row) { return row.name == name && row.value == value; });
  };
  EXPECT_TRUE(says("pressing", "0.80 N, loads 2 of 4"));
  EXPECT_TRUE(says("tilt", "cannot be told"));
  status.tilt = lump::PadTilt{1.23, -2, 0.4, 0.5};
  EXPECT_TRUE(says("tilt", "1.2, -2.0 \xc2\xb1 0.5\xc2\xb0"));
}

TEST_F(PanelTest, SettingsOfARunAreThoseOfTheTable) {
  RunSettings run;
  run.rate_Hz = 25;
  run.solver = SurfaceSolver::Best;
  const std::string words = words_of([&] {
    ImGui::Begin("run");
    ImGui::SetNextItemOpen(true);
    run_panel(run, 1);
    ImGui::End();
  });
  for (const char* name : {"rate_Hz", "patience_s", "solver", "sequence", "fixed_light", "loop"})
    EXPECT_EQ(count(words, run_setting(name).option + 2), 1u) << name << " in\n" << words;
  EXPECT_EQ(count(words, "25"), 1u) << words;
  EXPECT_EQ(count(words, "best"), 1u) << words;
  EXPECT_EQ(count(words, "default"), 1u) << "patience\n" << words;
}

}  // namespace
}  // namespace palpate::viz
