#include "viz/panels/banners.h"

#include <imgui.h>

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "viz/render/drawing.h"
#include "viz/render/format.h"

namespace palpate::viz {
namespace {

std::string camera_text(const CaptureCounts& c) {
  if (c.lost + c.damaged + c.gaps == 0) return {};
  return text("camera: %llu lost, %llu damaged, %llu gaps", static_cast<unsigned long long>(c.lost),
              static_cast<unsigned long long>(c.damaged), static_cast<unsigned long long>(c.gaps));
}

/// Frame and time, where no bar of a replay says them.
std::string place_text(const HudContent& content) {
  if (content.live && content.live->player) return "H: help";
  std::string place = text("frame %llu", static_cast<unsigned long long>(content.touch.sequence));
  if (!content.separate) place += text("   t = %.2f s", 1e-9 * static_cast<double>(content.touch.time_ns));
  return content.live ? place + "   H: help" : place;
}

}  // namespace

void status_line(const Layout& layout, const HudContent& content, float scale) {
  // Under all windows: the help covers it.
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  const ImVec2 low = corner(layout.status), high = far_corner(layout.status);
  const float y = low.y + (high.y - low.y - ImGui::GetFontSize()) / 2, margin = 12 * scale;
  const float gap = ImGui::CalcTextSize("   |   ").x;
  list->PushClipRect(low, high);
  // The last event stands first; the frame on the right.
  std::string right = place_text(content);
  std::string left = content.live ? content.live->note : "";
  const std::string camera = content.live ? camera_text(content.live->camera) : "";
  if (!camera.empty()) left = left.empty() ? camera : camera + "   |   " + left;
  const float room = high.x - low.x - 2 * margin;
  const float wanted = ImGui::CalcTextSize(right.c_str()).x;
  // The words on the left may take what the figures leave, but at least half.
  left = shortened(left, std::max(room - wanted - gap, room / 2));
  const float taken = left.empty() ? 0 : ImGui::CalcTextSize(left.c_str()).x + gap;
  right = shortened(right, room - taken);
  list->AddText({low.x + margin, y}, ink(theme().text), left.c_str());
  list->AddText({high.x - margin - ImGui::CalcTextSize(right.c_str()).x, y}, ink(theme().faint),
                right.c_str());
  list->PopClipRect();
}

void banner(const Layout& layout, const LiveStats& live, float scale) {
  std::vector<std::pair<std::string, Rgb>> lines;
  const Rgb red = theme().wrong, amber = theme().doubtful;
  const SessionStatus& s = live.session;
  if (!s.error.empty()) lines.emplace_back("RECORDING FAILED: " + s.error, red);
  if (live.recording && s.error.empty()) {
    std::string words = text("REC  %llu frames  %.0f MB", static_cast<unsigned long long>(s.recorded),
                             1e-6 * static_cast<double>(s.written_bytes));
    if (s.dropped > 0) words += text("  %llu DROPPED", static_cast<unsigned long long>(s.dropped));
    lines.emplace_back(words, s.dropped > 0 ? amber : red);
  }
  if (!live.state.empty()) lines.emplace_back(live.state, amber);
  ImDrawList* list = ImGui::GetBackgroundDrawList();
  float y = corner(layout.pictures).y + 12 * scale;
  const float left = corner(layout.pictures).x + 12 * scale;
  const float right = far_corner(layout.pictures).x - static_cast<float>(kColourBarRoom_px) * scale;
  for (const auto& [whole, colour] : lines) {
    const std::string words = shortened(whole, right - left - 30 * scale);
    const ImVec2 room = ImGui::CalcTextSize(words.c_str());
    const float x = std::max(left, right - room.x - 12 * scale);
    list->AddRectFilled({x - 22 * scale, y - 4 * scale}, {x + room.x + 10 * scale, y + room.y + 4 * scale},
                        ink(theme().panel, 225), 5 * scale);
    list->AddCircleFilled({x - 9 * scale, y + room.y / 2}, 5 * scale, ink(colour));
    list->AddText({x, y}, ink(colour), words.c_str());
    y += room.y + 14 * scale;
  }
}

}  // namespace palpate::viz
