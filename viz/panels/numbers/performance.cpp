#include "viz/panels/numbers/performance.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "viz/look/measures.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

unsigned long long whole_count(uint64_t value) {
  return value;
}

std::string percentiles_text(const Percentiles& p) {
  if (p.count == 0) return "-";
  return text("%.1f / %.1f / %.1f ms", p.p50_ms, p.p95_ms, p.p99_ms);
}

/// A bar for each picture: until measured, until drawn and handed over; the time of drawing as a line.
void draw_timeline(ImDrawList* list, ImVec2 low, ImVec2 high, const std::deque<PictureTimes>& times,
                   float scale) {
  double most_ms = 20;
  for (const PictureTimes& t : times) most_ms = std::max({most_ms, t.to_shown_ms, t.draw_ms});
  most_ms = scale_ceiling(most_ms);
  const auto y = [&](double ms) {
    return high.y - static_cast<float>(std::clamp(ms / most_ms, 0.0, 1.0)) * (high.y - low.y);
  };
  list->AddRectFilled(low, high, ink(theme().chart));
  const double step_ms = nice_ceiling(most_ms / 3);
  for (double ms = step_ms; ms < 1.001 * most_ms; ms += step_ms)
    list->AddLine({low.x, y(ms)}, {high.x, y(ms)}, ink(theme().grid));
  const float width = (high.x - low.x) / PictureTimes::kKept;
  float x = high.x - width * static_cast<float>(times.size());
  ImVec2 last{};
  for (const PictureTimes& t : times) {
    const float right = x + std::max(1.0f, width - 0.25f * scale);
    list->AddRectFilled({x, y(t.to_measured_ms)}, {right, high.y}, ink(theme().chosen));
    list->AddRectFilled({x, y(t.to_shown_ms)}, {right, y(t.to_measured_ms)}, ink(theme().frame));
    const ImVec2 drawn{x + width / 2, y(t.draw_ms)};
    if (&t != &times.front()) list->AddLine(last, drawn, ink(theme().second), 1.5f * scale);
    last = drawn;
    x += width;
  }
  list->AddRect(low, high, ink(theme().frame));
  const std::string top = text("%g ms", most_ms);
  list->AddText({low.x + kGrid_px / 2 * scale, low.y}, ink(theme().text), top.c_str());
}

void row(const char* label, const std::string& words, float column) {
  ImGui::TextDisabled("%s", label);
  ImGui::SameLine(column);
  ImGui::TextUnformatted(words.c_str());
}

}  // namespace

void performance_overlay(const Layout& layout, const HudContent& content, float scale) {
  const LiveStats& live = *content.live;
  const float margin = kGrid_px * scale, foot = far_corner(layout.pictures).y - 3 * margin;
  ImGui::SetNextWindowPos({corner(layout.pictures).x + margin, foot}, ImGuiCond_Always, {0, 1});
  ImGui::SetNextWindowBgAlpha(1);
  ImGui::Begin("performance", nullptr,
               ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoInputs | ImGuiWindowFlags_NoNav |
                   ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                   ImGuiWindowFlags_NoFocusOnAppearing | ImGuiWindowFlags_NoBringToFrontOnFocus);
  const float column = 12 * margin;
  row("rates",
      text("shown %.0f/s, measured %.0f/s, captured %.0f/s", live.shown_per_s, live.processed_per_s,
           live.captured_per_s),
      column);
  row("dropped",
      text("%llu not measured, %llu not shown", whole_count(live.dropped_before_engine),
           whole_count(live.dropped_before_display)),
      column);
  row("to measured", percentiles_text(live.to_measured) + "  (50, 95, 99 %)", column);
  row("to shown", percentiles_text(live.to_shown), column);
  std::string drawn = text("%.1f ms", live.draw_ms);
  if (content.mesh.first) drawn += text(", mesh %u x %u", content.mesh.first, content.mesh.second);
  row("drawing", drawn, column);
  row("device", shortened(content.device, 40 * margin - column), column);
  const ImVec2 low = ImGui::GetCursorScreenPos(), size{40 * margin, 8 * margin};
  draw_timeline(ImGui::GetWindowDrawList(), low, {low.x + size.x, low.y + size.y}, live.recent, scale);
  ImGui::Dummy(size);
  ImGui::TextColored(tint(theme().chosen), "until measured");
  ImGui::SameLine();
  ImGui::TextDisabled("until shown");
  ImGui::SameLine();
  ImGui::TextColored(tint(theme().second), "drawing (line)");
  ImGui::End();
}

}  // namespace palpate::viz
