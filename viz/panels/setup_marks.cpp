// Presses of the ball over the picture of the set-up; declared in setup_view.h.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "viz/panels/setup_view.h"
#include "viz/render/drawing.h"

namespace palpate::viz {

void SetupView::draw_balls(std::array<float, 2> low, double px_per_px, float scale) const {
  constexpr ImU32 kShadow = IM_COL32(0, 0, 0, 170);
  // Over a camera's picture colours are bright in either theme.
  const Theme& t = dark_theme();
  ImDrawList* list = ImGui::GetWindowDrawList();
  const ImVec2 mouse = ImGui::GetIO().MousePos;
  const SetupBall* pointed_at = nullptr;
  std::vector<ImVec2> labels;  // none over another: of presses at one place the mouse reads the rest
  double nearest = 1;          // of circles over each other that whose middle is nearest, by its radius
  list->PushClipRect({low[0], low[1]},
                     {low[0] + static_cast<float>(camera_px_[0] * px_per_px),
                      low[1] + static_cast<float>(camera_px_[1] * px_per_px)},
                     true);
  for (const SetupBall& ball : balls_) {
    const ImVec2 at{low[0] + static_cast<float>(ball.x_px * px_per_px),
                    low[1] + static_cast<float>(ball.y_px * px_per_px)};
    const auto radius = static_cast<float>(ball.radius_px * px_per_px);
    const Rgb colour = !ball.used ? t.wrong : ball.doubtful ? t.doubtful : t.chosen;
    list->AddCircle(at, radius, kShadow, 0, 3 * scale);
    list->AddCircle(at, radius, ink(colour), 0, 1.4f * scale);
    if (!ball.used) {  // crossed out
      const float side = 0.7f * radius;
      for (const float way : {-1.0f, 1.0f}) {
        const ImVec2 from{at.x - side, at.y - way * side}, to{at.x + side, at.y + way * side};
        list->AddLine(from, to, kShadow, 3 * scale);
        list->AddLine(from, to, ink(colour), 1.4f * scale);
      }
    }
    const ImVec2 words = ImGui::CalcTextSize(ball.label.c_str());
    const bool covers = std::ranges::any_of(labels, [&](const ImVec2& other) {
      return std::abs(other.x - at.x) < words.x + 4 * scale && std::abs(other.y - at.y) < words.y;
    });
    if (!ball.label.empty() && words.x < 2 * radius && !covers) {
      shadowed_text(list, {at.x - words.x / 2, at.y - words.y / 2}, ink(colour), ball.label);
      labels.push_back(at);
    }
    const double away = std::hypot(mouse.x - at.x, mouse.y - at.y) / radius;
    if (away < nearest) nearest = away, pointed_at = &ball;
  }
  list->PopClipRect();
  if (pointed_at && !help_ && ImGui::IsWindowHovered()) ImGui::SetTooltip("%s", pointed_at->words.c_str());
}

void SetupView::draw_place(std::array<float, 2> low, double px_per_px, float scale) const {
  if (!next_) return;
  std::array<ImVec2, 4> corners;
  for (size_t i = 0; i < 4; ++i)
    corners[i] = {low[0] + static_cast<float>(next_->corners[i][0] * px_per_px),
                  low[1] + static_cast<float>(next_->corners[i][1] * px_per_px)};
  ImDrawList* list = ImGui::GetWindowDrawList();
  list->AddConvexPolyFilled(corners.data(), 4, ink(dark_theme().doubtful, 36));
  list->AddPolyline(corners.data(), 4, ink(dark_theme().doubtful), ImDrawFlags_Closed, 2 * scale);
  const char* words = "press here too";
  const float left = (corners[0].x + corners[2].x - ImGui::CalcTextSize(words).x) / 2;
  shadowed_text(list, {left, corners[0].y + 4 * scale}, ink(dark_theme().doubtful), words);
}

}  // namespace palpate::viz
