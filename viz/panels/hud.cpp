#include "viz/panels/hud.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "viz/panels/actions/actions.h"
#include "viz/panels/actions/help.h"
#include "viz/panels/actions/palette.h"
#include "viz/panels/actions/text_field.h"
#include "viz/panels/actions/tool_bar.h"
#include "viz/panels/banners.h"
#include "viz/panels/charts/chart_menu.h"
#include "viz/panels/charts/chart_table.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/controls.h"
#include "viz/panels/numbers/performance.h"
#include "viz/panels/player/player_bar.h"
#include "viz/panels/sensor.h"
#include "viz/render/annotations.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

/// Why depths along the section may be wrong; empty where they are not.
std::string doubt(Validity depth) {
  switch (depth) {
    case Validity::Saturated:
      return "saturated: at least this";
    case Validity::AtBorder:
      return "at border: at least this";
    case Validity::Clipped:
      return "slopes clipped: at least this";
    case Validity::AboveRange:
      return "above range: at least this";
    case Validity::Apart:
      return "islands: not determined";
    case Validity::TooDeep:
      return "deeper than the pad: wrong";
    case Validity::Covered:
      return "covered by markers: not known";
    case Validity::Extrapolated:
      return "extrapolated: not calibrated for this";
    case Validity::LightUnknown:
      return "light unknown: not known";
    case Validity::PictureDamaged:
      return "picture damaged: not known";
    default:
      return {};
  }
}

/// With the cursor of keys, else of the mouse where it is over the charts.
ChartStyle charts_of(const ViewState& state, const Layout& layout, const History& history, float scale) {
  ChartStyle style{state.chart_span_s, state.whole_recording, scale, state.chart_view, state.chart_cursor};
  const ImGuiIO& io = ImGui::GetIO();
  if (!style.cursor && layout.has_charts && !io.WantCaptureMouse && inside(layout.charts, io.MousePos))
    style.cursor = time_under(io.MousePos.x, layout.charts, history, style);
  return style;
}

/// Where one line of words at the foot of the surface begins.
std::array<float, 2> foot_line(const ViewRect& surface, float scale) {
  return {corner(surface).x + 14 * scale, far_corner(surface).y - 20 * scale};
}

void mark_surface(ImDrawList* list, const SurfacePlace& on, const HudContent& content, const Touch& shown,
                  const Trail& trail, ViewState& state, const Profile* profile, float scale) {
  const SurfaceStyle style = state.style(2 * std::max(on.half_mm.x, on.half_mm.y));
  std::vector<PlacedText> placed;
  // Where numbers would overlap, the grid alone shows lengths.
  const bool roomy = is_roomy(on.view, scale);
  if (state.axes && roomy) placed = draw_axes(list, on.eye, on.view, on.half_mm, style, scale);
  draw_traction(list, on.eye, on.view, on.half_mm, content.traction, state.arrows,
                content.sensor.shear ? content.sensor.shear->friction : 0, scale);
  if (state.contacts)
    draw_touch(list, on, shown, content.frame.format,
               {.scale = scale,
                .unknown = content.unknown,
                .trail = &trail,
                .pitch_mm_per_px = content.sensor.pitch_mm_per_px},
               std::move(placed));
  if (profile) draw_section(list, on.view, on.eye, state.line, *profile, on.half_mm, style, scale);
  if (roomy && content.unknown && content.unknown->all)
    draw_unknown_key(list, foot_line(on.view, scale), *content.unknown, size_of(on.view).x - 28 * scale,
                     scale);
  const bool* follows = state.automatic();
  roomy ? draw_colour_bar(list, on.view, style, follows && *follows, scale)
        : draw_low_colour_bar(list, on.view, style, scale);
}

void mark_image(ImDrawList* list, const ViewRect& image, const HudContent& content, const Touch& shown,
                const Trail& trail, const ViewState& state, bool section, double full_shear_N, bool explains,
                float scale) {
  const FrameFormat& format = content.frame.format;
  const ImVec2 low = corner(image), high = far_corner(image);
  list->AddRect({low.x - 1, low.y - 1}, {high.x + 1, high.y + 1}, ink(theme().frame));
  draw_touch(list, image, shown, format,
             {state.contacts, state.skin, full_shear_N, scale, content.unknown, explains,
              state.contacts ? &trail : nullptr, content.sensor.pitch_mm_per_px});
  if (content.live && content.live->press && content.live->press->last)
    draw_lump(list, image, *content.live->press->last, content.sensor, format, scale);
  if (content.strain) draw_strain_bar(list, image, *content.strain, state, scale);
  if (section) draw_section(list, image, state.line, scale);
}

}  // namespace

void follow_double_click(const Layout& layout, ViewState& state) {
  const ImGuiIO& io = ImGui::GetIO();
  if (!ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) return;
  if (layout.has_image && layout.has_surface && inside(layout.image, io.MousePos)) {
    state.image_large = !state.image_large;
  } else if (layout.has_surface && inside(layout.surface, io.MousePos)) {
    state.camera = {};
  } else if (layout.has_map && inside(layout.map, io.MousePos)) {
    state.map_eye = {};
  }
}

void Hud::follow(const Touch& touch, uint64_t position) {
  history_.add(touch, position);
  trail_.add(touch);
  headline_.follow(touch, history_.timeline().separate);
  const auto reach = [this](const Estimate& x, const Estimate& y) {
    const double shear_N = std::hypot(x.value, y.value);
    if (x.validity != Validity::NotCalibrated && std::isfinite(shear_N))
      full_shear_N_ = std::max(full_shear_N_, shear_N);
  };
  reach(touch.shear_x_N, touch.shear_y_N);
  for (const ContactTouch& c : touch.contacts) reach(c.shear_x_N, c.shear_y_N);
}

std::string Hud::chart_table(const Sensor& sensor, const ViewState& state) const {
  return viz::chart_table(history_, shown_span(history_, charts_of(state, {}, history_, 1)), sensor);
}

void Hud::describe(HudFrame& frame, const Layout& layout, VkExtent2D extent, const HudContent& content,
                   ViewState& state, const Eye* eye, const Vec3& half_mm, const Profile* profile) {
  const float scale = frame.scale();
  const Touch shown = tared(content.touch, state.tare);
  ImDrawList* under = ImGui::GetBackgroundDrawList();
  const bool section = profile != nullptr;
  if (eye)
    mark_surface(under, {*eye, layout.surface, half_mm}, content, shown, trail_, state, profile, scale);
  if (layout.has_image)
    mark_image(under, layout.image, content, shown, trail_, state, section, full_shear_N_,
               !eye || !is_roomy(layout.surface, scale), scale);
  if (layout.has_map && content.map)
    draw_map_marks(under, layout.map, *content.map, state.map_eye, state.map, scale);
  const ChartStyle chart_style = charts_of(state, layout, history_, scale);
  if (layout.has_charts)
    draw_strip_charts(under, layout.charts, history_, content.sensor, state.tare, chart_style);
  if (layout.has_profile && profile)
    draw_profile(under, layout.profile, *profile,
                 doubt(content.touch.surface.value_or(SurfaceSummary{}).validity), scale);
  if (layout.has_panel) measurement_panel(frame, layout, content, shown, state);
  status_line(layout, content, scale);
  if (state.sensor_panel) sensor_panel(layout, scale, content.sensor, content.touch, state);
  if (state.rates && content.live) performance_overlay(layout, content, scale);
  if (layout.has_headline) headline_.draw(frame, layout, content.separate);
  if (!frame.has_window()) return;
  if (layout.has_tools) tool_bar(layout, scale, content.has_surface, content.live, state);
  if (state.controls && !(state.sensor_panel && layout.has_dock))
    control_window(layout, scale, content.has_surface, content.live, state);
  const bool player = content.live && content.live->player;
  if (content.live) banner(layout, *content.live, scale);
  if (player) player_bar(layout, scale, *content.live->player, content.touch.time_ns, history_, state);
  if (state.labelling) label_window(layout.pictures, scale, state);
  const Circumstances now = circumstances(content.live, content.has_surface, state);
  if (state.palette) palette_window(extent, scale, now, state);
  if (state.help) {
    help_window(extent, scale, key_help(now), state.help);
  } else if (eye && is_roomy(layout.surface, scale) && !(content.unknown && content.unknown->all)) {
    const auto [x, y] = foot_line(layout.surface, scale);
    under->AddText({x, y}, ink(theme().faint), "drag: orbit   wheel: zoom");
  }
  follow_chart_keys(history_, chart_style, state);
  if (std::exchange(state.chart_copy_requested, false))
    ImGui::SetClipboardText(chart_table(content.sensor, state).c_str());
  const bool at_charts =
      layout.has_charts && chart_mouse_.follow(layout.charts, history_, chart_style, state);
  if (state.chart_menu) chart_menu(layout.charts, scale, state);
  follow_double_click(layout, state);
  state.mouse_taken = at_charts || (section && section_mouse_.follow(state.line, layout.image, layout.surface,
                                                                     eye, half_mm, scale));
}

}  // namespace palpate::viz
