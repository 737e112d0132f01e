#include "viz/panels/actions/help.h"

#include <imgui.h>

#include <algorithm>

namespace palpate::viz {

void help_window(VkExtent2D extent, float scale, const std::vector<KeyHelp>& lines, bool& open) {
  const auto width = static_cast<float>(extent.width), height = static_cast<float>(extent.height);
  ImGui::SetNextWindowPos({width / 2, height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSizeConstraints({0, 0}, {width - 8, height - 8});
  ImGui::SetNextWindowFocus();     // over all other panels
  ImGui::SetNextWindowBgAlpha(1);  // and nothing of them shows through
  ImGui::Begin("Keys and mouse", &open,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  const size_t fit = std::max<size_t>(1, static_cast<size_t>(width / (380 * scale)));
  const size_t columns = std::min(fit, (lines.size() + 11) / 12);
  const size_t rows = (lines.size() + columns - 1) / columns;
  if (ImGui::BeginTable("keys", static_cast<int>(2 * columns), ImGuiTableFlags_SizingFixedFit)) {
    for (size_t i = 0; i < rows; ++i) {
      ImGui::TableNextRow();
      for (size_t at = i; at < lines.size(); at += rows) {
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(lines[at].keys.c_str());
        ImGui::TableNextColumn();
        ImGui::TextDisabled("%s", lines[at].what.c_str());
      }
    }
    ImGui::EndTable();
  }
  ImGui::Dummy({1, 2 * scale});
  ImGui::End();
}

}  // namespace palpate::viz
