#include "viz/panels/actions/tool_bar.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <utility>

#include "viz/look/measures.h"
#include "viz/panels/actions/help.h"
#include "viz/render/drawing.h"
#include "viz/render/fonts.h"

namespace palpate::viz {
namespace {

/// With an icon where there are icons; `words` beside it.
std::string face_of(const char* label, bool words) {
  const std::string icon = icon_of(label);
  return icon + (icon.empty() ? "" : words ? " " : "##") + label;
}

/// Gives the buttons icons and words; where the bar has no room for all words the least wanted go without,
/// and where it would be most of them, all. Without icons all have words. `order`: the most wanted first.
void choose_faces(std::vector<BarButton>& all, const std::vector<size_t>& order, float room) {
  const ImGuiStyle& style = ImGui::GetStyle();
  const auto put = [&](BarButton& button, bool words) {
    room += button.width;
    button.face = face_of(button.label, words);
    button.width = ImGui::CalcTextSize(face_of(button.longest, words).c_str(), nullptr, true).x +
                   2 * style.FramePadding.x;
    room -= button.width;
  };
  room -= style.ItemSpacing.x * static_cast<float>(all.size());
  for (BarButton& button : all) put(button, true);
  for (size_t wanted = order.size(); room < 0 && wanted > 0;) {
    put(all[order[--wanted]], false);
    if (2 * wanted >= order.size()) continue;
    for (; wanted > 0; --wanted) put(all[order[wanted - 1]], false);
  }
}

/// Buttons of a bar have more room around their words than those of a form.
void push_bar_style(float scale) {
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {kGrid_px * scale, kGrid_px / 2 * scale});
}

}  // namespace

std::vector<BarButton> bar_buttons(const Layout& layout, float scale, bool has_surface, const LiveStats* live,
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
      {7, "Pictures", "Pictures", with(GLFW_KEY_TAB, true), false, true},
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
  push_bar_style(scale);
  const ImGuiStyle& style = ImGui::GetStyle();
  float room = layout.has_tools ? size_of(layout.tools).x - 2 * style.WindowPadding.x : 0;
  choose_faces(all, order, room);
  for (const size_t i : order) {
    room -= all[i].width + style.ItemSpacing.x;
    if (room < 0) break;
    all[i].in_bar = true;
  }
  ImGui::PopStyleVar();
  return all;
}

void tool_bar(const Layout& layout, float scale, bool has_surface, const LiveStats* live, ViewState& state) {
  ImGui::SetNextWindowPos(corner(layout.tools));
  ImGui::SetNextWindowSize(size_of(layout.tools));
  ImGui::Begin("tools", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav);
  const std::vector<BarButton> all = bar_buttons(layout, scale, has_surface, live, state);
  push_bar_style(scale);
  ImGui::SetCursorPosY((size_of(layout.tools).y - ImGui::GetFrameHeight()) / 2);
  const ImGuiStyle& style = ImGui::GetStyle();
  float taken = -style.ItemSpacing.x;
  for (const BarButton& button : all)
    if (button.in_bar && button.last) taken += button.width + style.ItemSpacing.x;
  bool begun = false, at_end = false;
  for (const BarButton& button : all) {
    if (!button.in_bar) continue;
    if (begun) ImGui::SameLine();
    if (button.last && !std::exchange(at_end, true))
      ImGui::SetCursorPosX(size_of(layout.tools).x - style.WindowPadding.x - taken);
    begun = true;
    if (button.on) ImGui::PushStyleColor(ImGuiCol_Button, tint(theme().picked));
    const bool clicked = ImGui::Button(button.face.c_str(), {button.width, 0});
    if (button.on) ImGui::PopStyleColor();
    if (ImGui::IsItemHovered()) {
      const std::string_view label = button.label, word = label.substr(0, label.find("##"));
      ImGui::SetTooltip("%.*s: %s (%s)", static_cast<int>(word.size()), word.data(),
                        button.action->name.c_str(), words_of(button.action->chords.front()).c_str());
    }
    if (clicked) button.action->run(state);
  }
  ImGui::PopStyleVar();
  ImGui::End();
  const ImVec2 low = corner(layout.tools), high = far_corner(layout.tools);
  ImGui::GetBackgroundDrawList()->AddLine({low.x, high.y - scale}, {high.x, high.y - scale},
                                          ink(theme().grid), scale);
}

}  // namespace palpate::viz
