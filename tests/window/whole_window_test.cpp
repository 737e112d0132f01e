// The whole window as it is described to ImGui: letter by letter, nothing is cut and nothing lies over
// another, in every state and at every size.
#include <gtest/gtest.h>
#include <imgui.h>
#include <imgui_internal.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "capture/synthetic/synthetic.h"
#include "tests/support/gpu_fixture.h"
#include "tests/window/letters.h"
#include "viz/panels/actions/tool_bar.h"
#include "viz/panels/banners.h"
#include "viz/panels/hud.h"
#include "viz/panels/player/player_bar.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

class WholeWindow : public GpuTest {
 protected:
  struct Case {
    std::string name;
    Sensor sensor;
    Touch touch;
    LiveStats live;
    UnknownCells unknown = {};
  };

  WholeWindow() {
    Case gel{"a gel with skin and layer",
             synthetic_sensor(parse_synthetic("synthetic:drag?mode=gel&skin=texture")),
             everything(),
             {}};
    gel.live.from_list = true;
    Case rest{"a waveguide at rest", synthetic_sensor(parse_synthetic("synthetic:slide")), {}, {}};
    rest.touch.force_N.validity = rest.touch.shear_x_N.validity = Validity::NoContact;
    rest.touch.surface.emplace();
    rest.touch.regions.emplace();
    Case none{"no sensor file", {}, {}, {}};
    none.touch.contact = true;
    Case saturated = rest;
    saturated.name = "saturated, the camera lost";
    saturated.touch.contact = true;
    saturated.touch.force_N = {0.912, 0.011, Validity::Saturated};
    saturated.touch.shear_x_N = saturated.touch.shear_y_N = {-0.5, 0.1, Validity::Saturated};
    saturated.touch.slip = Slip::Slip;
    saturated.touch.surface->validity = Validity::Saturated;
    saturated.touch.saturated_px = 12345;
    saturated.live.state = "the camera is gone: waiting for it";
    saturated.live.recording = true;
    Case many = rest;
    many.name = "twelve contacts";
    many.touch.contact = true;
    many.touch.force_N = {12.345, 0.123, Validity::AtBorder};
    for (uint32_t i = 0; i < 12; ++i) {
      ContactTouch c;
      c.id = i + 1;
      c.area_px = 100 + 30 * i;
      c.area_mm2 = 1.5 * i;
      c.force_N = {0.1 * i, 0.01, i == 9 ? Validity::AboveRange : Validity::Valid};
      many.touch.contacts.push_back(c);
    }
    UnknownCells cells{160, 120, 4, std::vector<uint8_t>(size_t{160} * 120), 31};
    for (size_t i = 0; i < cells.reasons.size(); i += 3) cells.reasons[i] = static_cast<uint8_t>(1 << i % 5);
    many.unknown = saturated.unknown = none.unknown = cells;
    Case replay = gel;
    replay.name = "a recording with marks, of which a part is played";
    replay.live.player = PlayerStats{.name = "", .frames = 900, .position = 371, .speed = 0.25};
    Case pictures = none;
    pictures.name = "a folder of pictures";
    pictures.live.player =
        PlayerStats{.name = "a_long_name_of_a_picture_0371.png", .timed = false, .frames = 12};
    cases_ = {gel, rest, none, saturated, many, replay, pictures};
  }
  static Touch everything() {
    constexpr Estimate kKnown{-0.512, 0.104, Validity::Valid};
    Touch t;
    t.contact = true;
    t.slip = Slip::Incipient;
    t.force_N = t.shear_x_N = t.shear_y_N = kKnown;
    t.surface.emplace().volume_mm3 = 12.3;
    t.surface->depth_max_mm = 0.698;
    t.surface->depth_sd_mm = 0.012;
    t.surface->dented_mm2 = 42;
    t.regions = {0, true};
    t.contacts.resize(1);
    t.skin = {1452, 23, 5, kKnown, kKnown, kKnown, kKnown};
    TractionSummary& traction = t.traction.emplace();
    traction.fx_N = traction.fy_N = traction.fz_N = kKnown;
    traction.mx_Nmm = traction.my_Nmm = traction.mz_Nmm = kKnown;
    traction.pressure_max_kPa = 64;
    return t;
  }
  /// The letters of the second picture: windows have their size from then on.
  std::vector<Letter> draw(const Case& one, VkExtent2D extent, float scale, Arrangement arrangement = {},
                           bool image_large = false) {
    if (!frame_ || frame_->scale() != scale) {
      frame_.reset();
      frame_ = std::make_unique<HudFrame>(context(), pass_, 1, nullptr, scale);
    }
    Frame image;
    image.reshape({640, 480, 3, 8});
    const bool has_surface = one.touch.surface.has_value();
    const Layout layout = make_layout(extent, scale, image.format, has_surface,
                                      {.charts = true,
                                       .player = one.live.player.has_value(),
                                       .tools = true,
                                       .arrangement = arrangement,
                                       .image_large = image_large});
    ViewState state;
    state.arrangement = arrangement;
    state.image_large = image_large;
    if (one.live.player) state.part = PlayedPart{100, 700};
    state.fit_to(one.sensor);
    state.follow(one.touch, 25.6);
    Hud hud;
    if (one.live.player) hud.set_timeline({.timed = one.live.player->timed, .frames = 90, .rate_Hz = 10});
    Touch touch = one.touch;
    for (int i = 0; i < 90; ++i) {
      touch.time_ns = i * 100'000'000LL;
      hud.follow(touch, static_cast<uint64_t>(i));
    }
    hud.mark({20, 2.0, "mark", "first press"});
    hud.mark({21, 2.1, "mark", "and at once another"});
    hud.mark({88, 8.9, "mark", "let go"});
    HudContent content{one.sensor, image, touch, has_surface, &one.live, "a device", {96, 72}};
    const std::vector<float> kPa(40 * 30, 50.0f);
    if (one.touch.traction) content.traction = {40, 30, 16, kPa, kPa, kPa};
    if (one.unknown.all) content.unknown = &one.unknown;
    const SurfaceStyle style = state.style(25.6);
    const Vec3 half = surface_half_size_mm(640, 480, 0.04, style);
    const Eye eye = place(state.camera, half, layout.surface.aspect(), margins_of(layout.surface, scale));
    // The mouse is over the charts, at the end of time.
    ImGui::GetIO().MousePos = {far_corner(layout.charts).x - 30 * scale, middle(layout.charts).y};
    for (int i = 0; i < 3; ++i) {
      frame_->begin(extent);
      hud.describe(*frame_, layout, extent, content, state, layout.has_surface ? &eye : nullptr, half,
                   nullptr);
      tool_bar(layout, scale, has_surface, &one.live, state);
      banner(layout, one.live, scale);
      if (one.live.player) player_bar(layout, scale, *one.live.player, touch.time_ns, hud.history(), state);
      ImGui::Render();
    }
    for (const ImGuiWindow* window : ImGui::GetCurrentContext()->Windows)
      EXPECT_EQ(window->ScrollMax.y, 0) << window->Name << " has more than is seen";
    return letters_of(*ImGui::GetDrawData());
  }

  RenderPass pass_{context(), OffscreenTarget::kFormat, VK_SAMPLE_COUNT_1_BIT,
                   VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL};
  std::unique_ptr<HudFrame> frame_;
  std::vector<Case> cases_;
};

struct Size {
  VkExtent2D extent;
  float scale;
};
constexpr Size kSizes[] = {
    {{800, 600}, 1}, {{1280, 720}, 1}, {{1920, 1080}, 1}, {{3840, 2160}, 1}, {{3840, 2160}, 2}};

TEST_F(WholeWindow, NothingIsCutAndNothingLiesOverAnother) {
  for (const Case& one : cases_)
    for (const auto& [extent, scale] : kSizes) {
      SCOPED_TRACE(text("%s, %u x %u at %g", one.name.c_str(), extent.width, extent.height,
                        static_cast<double>(scale)));
      for (int i = 0; i < 2 * kArrangements; ++i) {
        const auto arrangement = static_cast<Arrangement>(i / 2);
        SCOPED_TRACE(text("%s, image large %d", to_string(arrangement), i % 2));
        const std::vector<Letter> letters = draw(one, extent, scale, arrangement, i % 2 != 0);
        ASSERT_GT(letters.size(), arrangement == Arrangement::OneAlone ? 40u : 200u);
        EXPECT_EQ(fault_of(letters, scale), "");
      }
    }
}

TEST_F(WholeWindow, FaultsAreSeen) {
  (void)draw(cases_[0], {1280, 720}, 1);
  const auto fault = [&](const std::function<void(ImDrawList&)>& content) {
    frame_->begin({1280, 720});
    content(*ImGui::GetBackgroundDrawList());
    ImGui::Render();
    return fault_of(letters_of(*ImGui::GetDrawData()), 1);
  };
  const auto write = [](ImDrawList& list, float x, const char* words) {
    list.AddText({x, 100}, IM_COL32_WHITE, words);
  };
  EXPECT_EQ(fault([&](ImDrawList& list) { write(list, 100, "apart"), write(list, 200, "from it"); }), "");
  EXPECT_NE(fault([&](ImDrawList& list) { write(list, 100, "one"), write(list, 103, "another"); }), "");
  EXPECT_NE(fault([&](ImDrawList& list) {
              list.PushClipRect({0, 0}, {120, 200});
              write(list, 100, "longer");
              list.PopClipRect();
            }),
            "");
}

TEST_F(WholeWindow, FiguresHaveOneWidth) {
  (void)draw(cases_[0], {1280, 720}, 1);
  for (const ImFont* font : ImGui::GetIO().Fonts->Fonts)
    for (ImWchar figure = '1'; figure <= '9'; ++figure)
      EXPECT_EQ(font->GetCharAdvance(figure), font->GetCharAdvance('0')) << font->FontSize;
}

TEST_F(WholeWindow, ButtonsHaveIconsWhereTheirFontIsInstalledElseWords) {
  LiveStats live;
  ViewState state;
  const auto faces = [&](uint32_t width, bool with_icons) {
    const Layout layout = make_layout({width, 720}, 1, {640, 480, 3, 8}, true, {.tools = true});
    std::vector<std::string> found;
    frame_->begin({width, 720});
    if (!with_icons) ImGui::PushFont(frame_->large());  // it has letters alone
    for (const BarButton& button : bar_buttons(layout, 1, true, &live, state)) found.push_back(button.face);
    if (!with_icons) ImGui::PopFont();
    frame_->abandon();
    return found;
  };
  (void)draw(cases_[0], {1280, 720}, 1);
  frame_->begin({1280, 720});
  const bool installed = !icon_of("Pause##pause").empty();
  EXPECT_EQ(icon_of("Nothing of the kind"), "");
  frame_->abandon();
  for (const std::string& face : faces(1280, false)) EXPECT_TRUE(std::isalpha(face[0])) << face;
  if (!installed) GTEST_SKIP() << "no font of icons";
  for (const std::string& face : faces(1600, true)) EXPECT_EQ(face[3], ' ') << face << ": icon and word";
  for (const std::string& face : faces(640, true)) EXPECT_EQ(face.substr(3, 2), "##") << face << ": an icon";
  live.from_list = true;  // one button more
  const std::vector<std::string> some = faces(1280, true);
  const auto with_words = std::ranges::count_if(some, [](const std::string& face) { return face[3] == ' '; });
  EXPECT_TRUE(2 * with_words > std::ssize(some) && with_words < std::ssize(some)) << with_words;
}

}  // namespace
}  // namespace palpate::viz
