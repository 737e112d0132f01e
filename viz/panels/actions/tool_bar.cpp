#include "viz/panels/actions/tool_bar.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <numeric>
#include <utility>

#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

float width_of(const BarButton& button) {
  return ImGui::CalcTextSize(button.longest, nullptr, true).x + 2 * ImGui::GetStyle().FramePadding.x;
}

}  // namespace

std::vector<BarButton> bar_buttons(const Layout& layout, bool has_surface, const LiveStats* live,
                                   const ViewState& state) {
  const Circumstances now = circumstances(live, has_surface, state);
  const bool recording = live && live->recording, zeroed = state.tare.on;
  const auto with = [&](int key, bool shift = false) { return action_of({key, shift}, now); };
  std::vector<BarButton> all{
      {3, state.paused ? "Continue##pause" : "Pause##pause", "Continue", with(GLFW_KEY_SPACE), state.paused},
      {2, recording ? "Stop##record" : "Record##record", "Record", with(GLFW_KEY_W), recording},
      {5, "Snapshot", "Snapshot", with(GLFW_KEY_S)},
      {4, zeroed ? "End zero##zero" : "Zero##zero", "End zero", with(GLFW_KEY_Z, zeroed), zeroed},
      {6, "Mark", "Mark", with(GLFW_KEY_M)},
      {9, "Text", "Text", with(GLFW_KEY_M, true), state.labelling},
      {7, "Sources", "Sources", with(GLFW_KEY_B), false, true},
      {10, "View", "View", with(GLFW_KEY_R), false, true},
      {8, "Sensor", "Sensor", with(GLFW_KEY_I), state.sensor_panel, true},
      {2, "Find", "Find", action_of({GLFW_KEY_K, false, true}, now), state.palette, true},
      {0, "Settings", "Settings", with(GLFW_KEY_C), state.controls, true},
      {1, "Help", "Help", with(GLFW_KEY_H), state.help, true},
  };
  std::erase_if(all, [&](const BarButton& button) { return !button.action->possible(now); });
  if (!live)
    std::erase_if(all, [](const BarButton& button) { return button.action->needs == Needs::NoPlayer; });

  std::vector<size_t> order(all.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::ranges::stable_sort(order, {}, [&](size_t i) { return all[i].rank; });
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
  const std::vector<BarButton> all = bar_buttons(layout, has_surface, live, state);
  const ImGuiStyle& style = ImGui::GetStyle();
  float taken = -style.ItemSpacing.x;
  for (const BarButton& button : all)
    if (button.in_bar && button.last) taken += width_of(button) + style.ItemSpacing.x;
  bool begun = false, at_end = false;
  for (const BarButton& button : all) {
    if (!button.in_bar) continue;
    if (begun) ImGui::SameLine();
    if (button.last && !std::exchange(at_end, true))
      ImGui::SetCursorPosX(size_of(layout.tools).x - style.WindowPadding.x - taken);
    begun = true;
    if (button.on) ImGui::PushStyleColor(ImGuiCol_Button, tint(theme().picked));
    const bool clicked = ImGui::Button(button.label, {width_of(button), 0});
    if (button.on) ImGui::PopStyleColor();
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s (%s)", button.action->name.c_str(),
                        words_of(button.action->chords.front()).c_str());
    if (clicked) button.action->run(state);
  }
  ImGui::End();
  const ImVec2 low = corner(layout.tools), high = far_corner(layout.tools);
  ImGui::GetBackgroundDrawList()->AddLine({low.x, high.y - scale}, {high.x, high.y - scale},
                                          ink(theme().grid), scale);
}

}  // namespace palpate::viz
