#include "viz/panels/player/player_bar.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "viz/look/measures.h"
#include "viz/panels/actions/actions.h"
#include "viz/panels/actions/help.h"
#include "viz/render/drawing.h"
#include "viz/render/fonts.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

/// Marks on thumbnails are bright with a dark rim, in either theme.
constexpr Rgb kBright{255, 255, 255}, kRim{0, 0, 0};

/// One button: the word that has an icon, and what stands for it where icons are not installed.
struct Button {
  const char* word;
  const char* plain;
  KeyPress key;
  bool on = false;
};

class Player {
 public:
  Player(const Layout& layout, float scale, const PlayerStats& player, const History& history,
         ViewState& state)
      : layout_(layout), scale_(scale), player_(player), history_(history), state_(state) {}

  void strip();
  void buttons();
  void place(int64_t time_ns);

 private:
  double last() const { return std::max(1.0, static_cast<double>(player_.frames) - 1); }
  float x_of(uint64_t frame) const {
    const double part = std::clamp(static_cast<double>(frame) / last(), 0.0, 1.0);
    return corner(layout_.strip).x + static_cast<float>(part) * size_of(layout_.strip).x;
  }
  uint64_t frame_at(float x) const {
    const float part = std::clamp((x - corner(layout_.strip).x) / size_of(layout_.strip).x, 0.0f, 1.0f);
    return static_cast<uint64_t>(std::lround(static_cast<double>(part) * last()));
  }
  std::string moment(uint64_t frame) const {
    const Timeline& timeline = history_.timeline();
    if (!timeline.timed) return text("frame %llu", static_cast<unsigned long long>(frame) + 1);
    const bool uneven = frame < timeline.uneven_s.size();
    const double since_s = uneven                 ? timeline.uneven_s[frame]
                           : timeline.rate_Hz > 0 ? static_cast<double>(frame) / timeline.rate_Hz
                                                  : 0;
    return text("%.2f s", timeline.start_s + since_s);
  }
  void draw_part(ImDrawList* list) const;
  void draw_flags(ImDrawList* list) const;
  void draw_place(ImDrawList* list) const;
  void tip(uint64_t frame, float x) const;

  const Layout& layout_;
  const float scale_;
  const PlayerStats& player_;
  const History& history_;
  ViewState& state_;
};

void Player::strip() {
  const ImVec2 low = corner(layout_.strip), high = far_corner(layout_.strip);
  const float top = corner(layout_.player).y;
  ImGui::SetCursorScreenPos({low.x, top});
  ImGui::InvisibleButton("strip", {high.x - low.x, high.y - top});
  const float x = ImGui::GetIO().MousePos.x;
  if (ImGui::IsItemActive())
    state_.seek_to = state_.bar_held = frame_at(x);
  else
    state_.bar_held.reset();
  const bool hovered = ImGui::IsItemHovered();
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddRect(low, high, ink(theme().frame));
  draw_part(list);
  draw_flags(list);
  draw_place(list);
  if (!hovered) return;
  list->AddLine({x, low.y}, {x, high.y}, ink(kBright, 160), scale_);
  tip(frame_at(x), x);
}

/// What is not played is dimmed; its ends are brackets.
void Player::draw_part(ImDrawList* list) const {
  if (!state_.part) return;
  const ImVec2 low = corner(layout_.strip), high = far_corner(layout_.strip);
  const float from = x_of(state_.part->first), to = x_of(state_.part->last);
  list->AddRectFilled(low, {from, high.y}, ink(kRim, 150));
  list->AddRectFilled({to, low.y}, high, ink(kRim, 150));
  const float tip = 4 * scale_;
  for (const auto& [x, inwards] : {std::pair{from, tip}, std::pair{to, -tip}})
    for (const auto& [colour, width] : {std::pair{kRim, 4.0f}, std::pair{kBright, 2.0f}}) {
      list->AddLine({x, low.y}, {x, high.y}, ink(colour), width * scale_);
      list->AddLine({x, low.y}, {x + inwards, low.y}, ink(colour), width * scale_);
      list->AddLine({x, high.y}, {x + inwards, high.y}, ink(colour), width * scale_);
    }
}

/// In order of time, none over another; the text where it has room.
void Player::draw_flags(ImDrawList* list) const {
  const ImVec2 low = corner(layout_.strip), high = far_corner(layout_.strip);
  const float top = corner(layout_.player).y, side = low.y - top, pennant = side / 2;
  std::vector<std::pair<float, const EventMark*>> flags;
  for (const EventMark& event : history_.events())
    flags.emplace_back(x_of(history_.timeline().frame_at(event.time)), &event);
  std::ranges::stable_sort(flags, {}, [](const auto& flag) { return flag.first; });
  for (size_t i = 0; i < flags.size(); ++i) {
    const float x = flags[i].first;
    list->AddLine({x, top + 2 * scale_}, {x, low.y}, ink(theme().text), 1.5f * scale_);
    list->AddLine({x, low.y}, {x, high.y}, ink(kBright, 150), scale_);
    list->AddTriangleFilled({x, top + 2 * scale_}, {x + pennant, top + 2 * scale_ + side / 4},
                            {x, top + 2 * scale_ + side / 2}, ink(theme().text));
    const float from = x + pennant + 4 * scale_;
    const float until = (i + 1 < flags.size() ? flags[i + 1].first : high.x) - 4 * scale_;
    const std::string& label = flags[i].second->label;
    if (from + ImGui::CalcTextSize(label.c_str()).x <= until)
      list->AddText({from, top + (side - ImGui::GetFontSize()) / 2}, ink(theme().text), label.c_str());
  }
}

/// The shown frame; while the strip is held it is where the hand is.
void Player::draw_place(ImDrawList* list) const {
  const ImVec2 low = corner(layout_.strip), high = far_corner(layout_.strip);
  const float x = x_of(state_.bar_held.value_or(player_.position)), arm = 5 * scale_;
  list->AddLine({x, low.y}, {x, high.y}, ink(kRim), 5 * scale_);
  list->AddLine({x, low.y}, {x, high.y}, ink(theme().slips), 2.5f * scale_);
  list->AddTriangleFilled({x - arm, high.y + arm}, {x + arm, high.y + arm}, {x, high.y - scale_},
                          ink(theme().slips));
}

void Player::tip(uint64_t frame, float x) const {
  std::string words = moment(frame);
  for (const EventMark& event : history_.events())
    if (std::abs(x_of(history_.timeline().frame_at(event.time)) - x) < 6 * scale_)
      words += "\n" + event.label;
  ImGui::SetTooltip("%s", words.c_str());
}

void Player::buttons() {
  const Button all[] = {
      {"Step back", "|<", {GLFW_KEY_COMMA}},
      {state_.paused ? "Continue" : "Pause", state_.paused ? ">" : "||", {GLFW_KEY_SPACE}},
      {"Step on", ">|", {GLFW_KEY_PERIOD}},
      {"Slower", "-", {GLFW_KEY_DOWN}},
      {"Faster", "+", {GLFW_KEY_UP}},
      {"", "A", kLoopFrom, state_.part.has_value()},
      {"", "B", kLoopTo, state_.part.has_value()},
      {"No loop", "x", {GLFW_KEY_BACKSPACE}},
      {"Largest", "max", {'F', true}},
      {"Mark before", "<", kMarkBefore},
      {"Mark after", ">", kMarkAfter},
  };
  const float right = far_corner(layout_.player).x - kGrid_px * scale_, side = 28 * scale_;
  ImGui::SetCursorScreenPos(
      {corner(layout_.player).x + kGrid_px * scale_, far_corner(layout_.strip).y + 6 * scale_});
  ImGui::PushStyleVar(ImGuiStyleVar_FramePadding, {2 * scale_, 2 * scale_});
  ImGui::PushStyleVar(ImGuiStyleVar_ItemSpacing, {kGrid_px / 2 * scale_, 0});
  for (const Button& button : all) {
    if (ImGui::GetCursorScreenPos().x + side > right) break;
    const std::string icon = *button.word ? icon_of(button.word) : std::string();
    const Action* action = action_of(button.key, {.player = true});
    const std::string face = (icon.empty() ? button.plain : icon) + "##" + action->name;
    if (button.on) ImGui::PushStyleColor(ImGuiCol_Button, tint(theme().picked));
    const bool clicked = ImGui::Button(face.c_str(), {side, 0});
    if (button.on) ImGui::PopStyleColor();
    if (ImGui::IsItemHovered())
      ImGui::SetTooltip("%s (%s)", action->name.c_str(), words_of(action->chords.front()).c_str());
    if (clicked) action->run(state_);
    ImGui::SameLine();
  }
  ImGui::PopStyleVar(2);
}

/// The most important words that have room: the time, its frame, the speed.
void Player::place(int64_t time_ns) {
  const float room = far_corner(layout_.player).x - kGrid_px * scale_ - ImGui::GetCursorScreenPos().x;
  const std::string at = player_.timed ? text("%.2f s", 1e-9 * static_cast<double>(time_ns)) : player_.name;
  const std::string whole =
      at + text("   frame %llu of %llu", static_cast<unsigned long long>(player_.position) + 1,
                static_cast<unsigned long long>(player_.frames));
  const std::string speed = player_.speed != 1 ? text("   %gx", player_.speed) : "";
  for (const std::string& words : {whole + speed, at + speed, at}) {
    const float width = ImGui::CalcTextSize(words.c_str()).x;
    if (width > room) continue;
    ImGui::SetCursorScreenPos(
        {far_corner(layout_.player).x - kGrid_px * scale_ - width, far_corner(layout_.strip).y + 8 * scale_});
    ImGui::TextUnformatted(words.c_str());
    return;
  }
}

}  // namespace

void player_bar(const Layout& layout, float scale, const PlayerStats& player, int64_t time_ns,
                const History& history, ViewState& state) {
  ImGui::SetNextWindowPos(corner(layout.player));
  ImGui::SetNextWindowSize(size_of(layout.player));
  ImGui::PushStyleVar(ImGuiStyleVar_WindowPadding, {0, 0});
  ImGui::Begin("player", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoSavedSettings |
                   ImGuiWindowFlags_NoBackground | ImGuiWindowFlags_NoNav);
  ImGui::PopStyleVar();
  Player bar(layout, scale, player, history, state);
  bar.strip();
  bar.buttons();
  bar.place(time_ns);
  ImGui::End();
}

}  // namespace palpate::viz
