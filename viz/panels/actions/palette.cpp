#include "viz/panels/actions/palette.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>

#include "viz/panels/actions/help.h"
#include "viz/panels/actions/text_field.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

void close(ViewState& state) {
  state.palette = false;
  state.searched = {};
  state.found = 0;
}

}  // namespace

void palette_key(const KeyPress& press, const Circumstances& now, ViewState& state) {
  switch (press.key) {
    case GLFW_KEY_DOWN:
      ++state.found;
      break;
    case GLFW_KEY_UP:
      --state.found;
      break;
    case GLFW_KEY_ENTER:
    case GLFW_KEY_KP_ENTER: {
      const std::vector<const Action*> named = actions_named(state.searched.text.data(), now);
      const int at = state.found;
      close(state);
      if (!named.empty())
        named[static_cast<size_t>(std::clamp(at, 0, static_cast<int>(named.size()) - 1))]->run(state);
      break;
    }
    case GLFW_KEY_ESCAPE:
      close(state);
      break;
    default:
      break;
  }
}

void palette_window(VkExtent2D extent, float scale, const Circumstances& now, ViewState& state) {
  constexpr int kRows = 12;  // further ones by scrolling
  const auto width = static_cast<float>(extent.width), height = static_cast<float>(extent.height);
  const float wide = std::min(520 * scale, width - 16);
  ImGui::SetNextWindowPos({width / 2, height / 8}, ImGuiCond_Always, {0.5f, 0});
  ImGui::SetNextWindowSize({wide, 0});
  ImGui::SetNextWindowFocus();
  ImGui::SetNextWindowBgAlpha(1);
  bool open = true;
  ImGui::Begin("Find an action or a setting", &open,
               ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  ImGui::SetNextItemWidth(-1);
  const auto before = state.searched.text;
  text_field("##searched", "words of its name", state.searched);
  if (before != state.searched.text) state.found = 0;
  const std::vector<const Action*> named = actions_named(state.searched.text.data(), now);
  state.found = std::clamp(state.found, 0, std::max(0, static_cast<int>(named.size()) - 1));
  const float row = ImGui::GetTextLineHeightWithSpacing();
  const float room = height - height / 8 - 4 * ImGui::GetFrameHeightWithSpacing();
  ImGui::BeginChild("found", {0, std::min(kRows * row, std::max(row, room))}, false, ImGuiWindowFlags_NoNav);
  const Action* clicked = nullptr;
  for (size_t i = 0; i < named.size(); ++i) {
    const Action& action = *named[i];
    const bool chosen = static_cast<int>(i) == state.found;
    if (ImGui::Selectable(action.name.c_str(), chosen)) clicked = &action;
    if (chosen && !ImGui::IsItemVisible()) ImGui::SetScrollHereY(0.5f);
    if (action.chords.empty()) continue;
    const std::string keys = words_of(action.chords.front());
    ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(keys.c_str()).x);
    ImGui::TextDisabled("%s", keys.c_str());
  }
  if (named.empty()) ImGui::TextDisabled("nothing has these words in its name");
  ImGui::EndChild();
  ImGui::End();
  if (!open || clicked) close(state);
  if (clicked) clicked->run(state);
}

}  // namespace palpate::viz
