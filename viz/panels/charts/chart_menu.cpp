#include "viz/panels/charts/chart_menu.h"

#include <imgui.h>

#include <array>

#include "viz/look/measures.h"
#include "viz/render/drawing.h"

namespace palpate::viz {

void chart_menu(const ViewRect& charts, float scale, ViewState& state) {
  // Upwards, so that the foot of the window does not cut it, and not over its right end.
  const std::array<float, 2> at = *state.chart_menu;
  const bool right = at[0] > middle(charts).x;
  ImGui::SetNextWindowPos({at[0], at[1]}, ImGuiCond_Always, {right ? 1.0f : 0.0f, 1});
  ImGui::SetNextWindowFocus();
  ImGui::SetNextWindowBgAlpha(1);
  ImGui::PushStyleVar(ImGuiStyleVar_WindowBorderSize, scale);
  ImGui::Begin("charts", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  ImGui::PopStyleVar();
  const auto item = [scale](const char* words) {
    return ImGui::Selectable(words, false, 0, {18 * kGrid_px * scale, 0});
  };
  bool done = true;
  if (item("Save as CSV (Shift + S)"))
    state.chart_table_requested = true;
  else if (item("Save as PNG (Shift + S)"))
    state.chart_picture_requested = true;
  else if (item("Copy as CSV (Ctrl + C)"))
    state.chart_copy_requested = true;
  else if (item("All of the time (Shift + P)"))
    state.chart_view.reset(), state.whole_recording = true;
  else
    done = ImGui::IsMouseClicked(ImGuiMouseButton_Left) &&
           !ImGui::IsWindowHovered(ImGuiHoveredFlags_AllowWhenBlockedByActiveItem);
  ImGui::End();
  if (done) state.chart_menu.reset();
}

}  // namespace palpate::viz
