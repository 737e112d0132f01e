#include "viz/panels/tool_bar.h"

#include <imgui.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

float width_of(const Action& action) {
  return ImGui::CalcTextSize(action.longest, nullptr, true).x + 2 * ImGui::GetStyle().FramePadding.x;
}

}  // namespace

std::vector<Action> actions(const Layout& layout, bool has_surface, const LiveStats* live, ViewState& state) {
  std::vector<Action> all;
  const bool recording = live && live->recording;
  all.push_back({.rank = 3,
                 .label = state.paused ? "Continue##pause" : "Pause##pause",
                 .longest = "Continue",
                 .tip = "hold the picture, or go on (Space)",
                 .on = state.paused,
                 .done = [&state] { state.paused = !state.paused; }});
  if (live && !live->player)
    all.push_back({.rank = 2,
                   .label = recording ? "Stop##record" : "Record##record",
                   .longest = "Record",
                   .tip = "write a session, or end it (W)",
                   .on = recording,
                   .done = [&state] { state.recording_switched_requested = true; }});
  all.push_back({.rank = 5,
                 .label = "Snapshot",
                 .longest = "Snapshot",
                 .tip = "picture, frame and numbers of this moment (S)",
                 .done = [&state] { state.snapshot_requested = true; }});
  all.push_back(
      {.rank = 4,
       .label = state.tare.on ? "End zero##zero" : "Zero##zero",
       .longest = "End zero",
       .tip = "force and shear count from here (Z; Shift + Z ends it)",
       .on = state.tare.on,
       .done = [&state] { (state.tare.on ? state.zero_cleared_requested : state.zero_requested) = true; }});
  all.push_back({.rank = 6, .label = "Mark", .longest = "Mark", .tip = "mark an event (M)", .done = [&state] {
                   state.mark_requested = true;
                 }});
  all.push_back({.rank = 9,
                 .label = "Text",
                 .longest = "Text",
                 .tip = "mark an event with a text (Shift + M)",
                 .on = state.labelling,
                 .done = [&state] { state.labelling = true; }});
  if (live && live->from_list)
    all.push_back({.rank = 7,
                   .label = "Sources",
                   .longest = "Sources",
                   .tip = "back to the list of sources (B)",
                   .last = true,
                   .done = [&state] { state.sources_requested = true; }});
  if (has_surface)
    all.push_back({.rank = 10,
                   .label = "View",
                   .longest = "View",
                   .tip = "all of the surface again (R)",
                   .last = true,
                   .done = [&state] { state.camera = {}; }});
  all.push_back({.rank = 8,
                 .label = "Sensor",
                 .longest = "Sensor",
                 .tip = "the sensor and its calibrations (I)",
                 .on = state.sensor_panel,
                 .last = true,
                 .done = [&state] { state.sensor_panel = !state.sensor_panel; }});
  all.push_back({.rank = 0,
                 .label = "Settings",
                 .longest = "Settings",
                 .tip = "colours, charts, marks and text (C)",
                 .on = state.controls,
                 .last = true,
                 .done = [&state] { state.controls = !state.controls; }});
  all.push_back({.rank = 1,
                 .label = "Help",
                 .longest = "Help",
                 .tip = "all keys (H)",
                 .on = state.help,
                 .last = true,
                 .done = [&state] { state.help = !state.help; }});

  std::vector<size_t> order(all.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::sort(order, {}, [&](size_t i) { return all[i].rank; });
  const ImGuiStyle& style = ImGui::GetStyle();
  float room = layout.has_tools ? size_of(layout.tools).x - 2 * style.WindowPadding.x : 0;
  for (const size_t i : order) {
    room -= width_of(all[i]) + style.ItemSpacing.x;
    if (room < 0) break;
    all[i].in_bar = true;
  }
  return all;
}

void tool_bar(const Layout& layout, float scale, bool has_surface, const LiveStats* live, ViewState& state) {
  ImGui::SetNextWindowPos(corner(layout.tools));
  ImGui::SetNextWindowSize(size_of(layout.tools));
  ImGui::Begin("tools", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav);
  ImGui::SetCursorPosY((size_of(layout.tools).y - ImGui::GetFrameHeight()) / 2);
  const std::vector<Action> all = actions(layout, has_surface, live, state);
  const ImGuiStyle& style = ImGui::GetStyle();
  float taken = -style.ItemSpacing.x;
  for (const Action& action : all)
    if (action.in_bar && action.last) taken += width_of(action) + style.ItemSpacing.x;
  bool begun = false, at_end = false;
  for (const Action& action : all) {
    if (!action.in_bar) continue;
    if (begun) ImGui::SameLine();
    if (action.last && !std::exchange(at_end, true))
      ImGui::SetCursorPosX(size_of(layout.tools).x - style.WindowPadding.x - taken);
    begun = true;
    if (action.on) ImGui::PushStyleColor(ImGuiCol_Button, tint(theme().picked));
    const bool clicked = ImGui::Button(action.label, {width_of(action), 0});
    if (action.on) ImGui::PopStyleColor();
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", action.tip);
    if (clicked) action.done();
  }
  ImGui::End();
  const ImVec2 low = corner(layout.tools), high = far_corner(layout.tools);
  ImGui::GetBackgroundDrawList()->AddLine({low.x, high.y - scale}, {high.x, high.y - scale},
                                          ink(theme().grid), scale);
}

}  // namespace palpate::viz
