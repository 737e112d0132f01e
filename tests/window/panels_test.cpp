// Panels as they are described to ImGui, without a window: words that have room, words that lie over nothing,
// and what is said of a pad at rest.
#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <string_view>

#include "engine/base/text.h"
#include "tests/window/panel_fixture.h"
#include "viz/panels/actions/help.h"
#include "viz/panels/actions/palette.h"
#include "viz/panels/actions/tool_bar.h"
#include "viz/panels/charts/chart.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/controls.h"
#include "viz/panels/hud.h"
#include "viz/panels/run_panel.h"
#include "viz/panels/start/card_grid.h"
#include "viz/render/annotations.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

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
