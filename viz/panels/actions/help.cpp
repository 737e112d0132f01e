#include "viz/panels/actions/help.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <utility>

#include "viz/panels/actions/actions.h"
#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

constexpr std::array<std::pair<int, const char*>, 22> kKeyNames{{
    {GLFW_KEY_SPACE, "Space"},     {GLFW_KEY_TAB, "Tab"},         {GLFW_KEY_ENTER, "Enter"},
    {GLFW_KEY_KP_ENTER, "Enter"},  {GLFW_KEY_ESCAPE, "Esc"},      {GLFW_KEY_BACKSPACE, "Backspace"},
    {GLFW_KEY_LEFT, "Left"},       {GLFW_KEY_RIGHT, "Right"},     {GLFW_KEY_UP, "Up"},
    {GLFW_KEY_DOWN, "Down"},       {GLFW_KEY_PAGE_UP, "Page up"}, {GLFW_KEY_PAGE_DOWN, "Page down"},
    {GLFW_KEY_HOME, "Home"},       {GLFW_KEY_END, "End"},         {GLFW_KEY_F1, "F1"},
    {GLFW_KEY_F11, "F11"},         {GLFW_KEY_EQUAL, "+"},         {GLFW_KEY_KP_ADD, "+"},
    {GLFW_KEY_MINUS, "-"},         {GLFW_KEY_KP_SUBTRACT, "-"},   {GLFW_KEY_LEFT_BRACKET, "["},
    {GLFW_KEY_RIGHT_BRACKET, "]"},
}};

}  // namespace

std::string words_of(const KeyPress& chord) {
  std::string words = std::string(chord.control ? "Ctrl + " : "") + (chord.alt ? "Alt + " : "") +
                      (chord.shift ? "Shift + " : "");
  const auto* const named = std::ranges::find(kKeyNames, chord.key, &std::pair<int, const char*>::first);
  if (named != kKeyNames.end()) return words + named->second;
  return words + static_cast<char>(chord.key);  // letters and signs are their own codes
}

std::vector<KeyHelp> key_help(const Circumstances& now) {
  return key_help(now, nullptr);
}

std::vector<KeyHelp> key_help(const Circumstances& now, bool (*has)(const Action&)) {
  std::vector<KeyHelp> lines;
  if (now.has_surface)
    lines = {{"drag the surface", "orbit"},
             {"right drag, Shift + drag", "pan"},
             {"wheel", "zoom"},
             {"double click", "all of it again"}};
  if (!has) {
    if (now.has_surface) lines.push_back({"double click on the image", "they change places"});
    lines.push_back({"wheel, drag in the charts", "zoom, pan time"});
    lines.push_back({"double click, right click there", "all of the time, menu"});
    if (now.player) lines.push_back({"click there", "go to that time"});
  }
  const std::string* shared = nullptr;
  const KeyPress* before = nullptr;
  for (const Action& action : actions()) {
    if (action.chords.empty() || !action.possible(now) || (has && !has(action))) continue;
    const bool goes_on = shared && *shared == action.line;
    if (!goes_on) lines.push_back({"", action.line.empty() ? action.name : action.line});
    shared = action.line.empty() ? nullptr : &action.line;
    std::string& keys = lines.back().keys;
    for (const KeyPress& chord : action.chords) {
      const std::string words = words_of(chord);
      const bool held = before && !keys.empty() && before->shift == chord.shift &&
                        before->control == chord.control && before->alt == chord.alt;
      // Those of the number pad have the same names.
      if (!(held && words_of(*before) == words))
        keys += (keys.empty() ? "" : " / ") + (held ? words_of({chord.key}) : words);
      before = &chord;
    }
  }
  return lines;
}

void help_window(VkExtent2D extent, float scale, const std::vector<KeyHelp>& lines, bool& open) {
  const auto width = static_cast<float>(extent.width), height = static_cast<float>(extent.height);
  ImGui::SetNextWindowPos({width / 2, height / 2}, ImGuiCond_Always, {0.5f, 0.5f});
  ImGui::SetNextWindowSizeConstraints({0, 0}, {width - 8, height - 8});
  ImGui::SetNextWindowFocus();     // over all other panels
  ImGui::SetNextWindowBgAlpha(1);  // and nothing of them shows through
  ImGui::Begin("Keys and mouse", &open,
               ImGuiWindowFlags_AlwaysAutoResize | ImGuiWindowFlags_NoCollapse | ImGuiWindowFlags_NoMove |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoNav);
  const ImGuiStyle& style = ImGui::GetStyle();
  float keys_px = 0, words_px = 0;
  for (const KeyHelp& line : lines) {
    keys_px = std::max(keys_px, ImGui::CalcTextSize(line.keys.c_str()).x);
    words_px = std::max(words_px, ImGui::CalcTextSize(line.what.c_str()).x);
  }
  // As few columns as show all lines, and no more than have room for two fifths of their longest words, which
  // wrap.
  const float room = width - 8 - 2 * style.WindowPadding.x - style.ScrollbarSize,
              apart = 4 * style.CellPadding.x;
  const auto high = static_cast<size_t>(std::max(1.0f, height / ImGui::GetTextLineHeightWithSpacing() - 4));
  const auto fit = static_cast<size_t>(std::max(1.0f, room / (keys_px + 0.4f * words_px + apart)));
  const size_t columns = std::clamp((lines.size() + high - 1) / high, size_t{1}, fit);
  const size_t rows = (lines.size() + columns - 1) / columns;
  words_px = std::min(words_px, room / static_cast<float>(columns) - keys_px - apart);
  if (ImGui::BeginTable("keys", static_cast<int>(2 * columns), ImGuiTableFlags_SizingFixedFit)) {
    for (size_t i = 0; i < columns; ++i) {
      ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, keys_px);
      ImGui::TableSetupColumn("", ImGuiTableColumnFlags_WidthFixed, words_px);
    }
    for (size_t i = 0; i < rows; ++i) {
      ImGui::TableNextRow();
      for (size_t at = i; at < lines.size(); at += rows) {
        ImGui::TableNextColumn();
        ImGui::TextUnformatted(lines[at].keys.c_str());
        ImGui::TableNextColumn();
        wrapped_text(lines[at].what, tint(theme().faint));
      }
    }
    ImGui::EndTable();
  }
  ImGui::Dummy({1, 2 * scale});
  ImGui::End();
}

}  // namespace palpate::viz
