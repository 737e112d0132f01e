#include "viz/annotations.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "shaders/shared/colormap.h"
#include "viz/view_state.h"

namespace palpate::viz {
namespace {

constexpr ImU32 kLine = IM_COL32(170, 178, 190, 255);
constexpr ImU32 kText = IM_COL32(205, 211, 220, 255);
constexpr ImU32 kMarker = IM_COL32(255, 176, 59, 255);
constexpr ImU32 kArrow = IM_COL32(92, 200, 255, 255);
constexpr ImU32 kShadow = IM_COL32(0, 0, 0, 170);

ImU32 map_colour(double t) {
  const auto v = static_cast<float>(t);
  return ImGui::ColorConvertFloat4ToU32({viridis_red(v), viridis_green(v), viridis_blue(v), 1});
}

std::string number(double value, double step) {
  char text[32];
  const int decimals = step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9));
  std::snprintf(text, sizeof text, "%.*f", decimals, std::abs(value) < 1e-9 ? 0.0 : value);
  return text;
}

void centred_text(ImDrawList* list, ImVec2 at, const std::string& text, ImU32 colour = kText) {
  const ImVec2 size = ImGui::CalcTextSize(text.c_str());
  list->AddText({std::round(at.x - size.x / 2), std::round(at.y - size.y / 2)}, colour, text.c_str());
}

// Draws lines and labels given in world mm.
class Pen {
 public:
  Pen(ImDrawList* list, const Eye& eye, const ViewRect& rect) : list_(list), eye_(eye), rect_(rect) {}

  bool at(const Vec3& world, ImVec2& screen) const {
    const Projected p = eye_.project(world);
    screen = {static_cast<float>(rect_.x + p.x * rect_.width),
              static_cast<float>(rect_.y + p.y * rect_.height)};
    return p.in_front;
  }
  void line(const Vec3& a, const Vec3& b, float width) const {
    ImVec2 from, to;
    if (at(a, from) && at(b, to)) list_->AddLine(from, to, kLine, width);
  }
  // The label sits beyond `world`, on the side away from `inside`, by as many pixels whatever the zoom.
  void label(const Vec3& world, const Vec3& inside, float away_px, const std::string& text) const {
    ImVec2 p, q;
    if (!at(world, p) || !at(inside, q)) return;
    const float dx = p.x - q.x, dy = p.y - q.y;
    const float length = std::max(std::hypot(dx, dy), 1e-3f);
    centred_text(list_, {p.x + dx / length * away_px, p.y + dy / length * away_px}, text);
  }

 private:
  ImDrawList* list_;
  const Eye& eye_;
  const ViewRect& rect_;
};

}  // namespace

void draw_axes(ImDrawList* list, const Eye& eye, const ViewRect& clip, const ViewRect& view,
               const Vec3& half_mm, const SurfaceStyle& style, float scale) {
  const auto left = static_cast<float>(clip.x), top = static_cast<float>(clip.y);
  list->PushClipRect({left, top},
                     {left + static_cast<float>(clip.width), top + static_cast<float>(clip.height)});
  const Pen pen(list, eye, view);
  const double side_x = eye.backward.x >= 0 ? 1 : -1, side_y = eye.backward.y >= 0 ? 1 : -1;
  const double step = nice_ceiling(std::max(half_mm.x, half_mm.y) / 3.5);
  const double tick = 0.025 * std::max(half_mm.x, half_mm.y);
  const float near_px = 15 * scale, far_px = 34 * scale;

  const double y = side_y * half_mm.y, x = side_x * half_mm.x;
  pen.line({-half_mm.x, y, 0}, {half_mm.x, y, 0}, scale);
  for (double v = -std::floor(half_mm.x / step) * step; v <= half_mm.x + 1e-9; v += step) {
    pen.line({v, y, 0}, {v, y + side_y * tick, 0}, scale);
    pen.label({v, y + side_y * tick, 0}, {v, y - side_y * half_mm.y, 0}, near_px, number(v, step));
  }
  const double between = 0.5 * step;  // titles stand between two numbers
  pen.label({between, y + side_y * tick, 0}, {between, y - side_y * half_mm.y, 0}, far_px, "x [mm]");
  pen.line({x, -half_mm.y, 0}, {x, half_mm.y, 0}, scale);
  for (double v = -std::floor(half_mm.y / step) * step; v <= half_mm.y + 1e-9; v += step) {
    pen.line({x, v, 0}, {x + side_x * tick, v, 0}, scale);
    pen.label({x + side_x * tick, v, 0}, {x - side_x * half_mm.x, v, 0}, near_px, number(-v, step));
  }
  pen.label({x + side_x * tick, between, 0}, {x - side_x * half_mm.x, between, 0}, far_px, "y [mm]");

  // Depth hangs from the lower of the two outer corners: nothing hides it there, and no other label is below.
  if (std::abs(eye.backward.z) < 0.97) {
    const Vec3 a{-side_x * half_mm.x, side_y * half_mm.y, 0}, b{side_x * half_mm.x, -side_y * half_mm.y, 0};
    const bool first = eye.project(a).y > eye.project(b).y;
    const Vec3 corner = first ? a : b;
    const double side = dot(corner, eye.right) < 0 ? -1 : 1;
    const double depth_step = nice_ceiling(style.range_mm / 4);
    const auto below = [&](double depth_mm) { return corner + Vec3{0, 0, -depth_mm * style.exaggeration}; };
    pen.line(corner, below(style.range_mm), scale);
    const Vec3 outward = eye.right * (side * tick);
    for (double d = 0; d <= style.range_mm * (1 + 1e-9); d += depth_step) {
      pen.line(below(d), below(d) + outward, scale);
      if (d > 0) pen.label(below(d) + outward, below(d), near_px, number(d, depth_step));
    }
    char title[48];
    std::snprintf(title, sizeof title, "depth [mm] x%.3g", style.exaggeration);
    ImVec2 end;
    if (pen.at(below(style.range_mm), end)) centred_text(list, {end.x, end.y + 14 * scale}, title);
  }
  list->PopClipRect();
}

void draw_colour_bar(ImDrawList* list, const ViewRect& rect, const SurfaceStyle& style, bool automatic,
                     float scale) {
  constexpr int kBands = 64;
  const float width = 16 * scale;
  const float height = std::min(0.42f * static_cast<float>(rect.height), 280 * scale);
  const float x = static_cast<float>(rect.x) + static_cast<float>(rect.width) - 72 * scale;
  const float y = static_cast<float>(rect.y) + 44 * scale;
  for (int i = 0; i < kBands; ++i) {
    const double t0 = static_cast<double>(i) / kBands, t1 = static_cast<double>(i + 1) / kBands;
    const ImU32 above = map_colour(t0), below = map_colour(t1);
    list->AddRectFilledMultiColor({x, y + static_cast<float>(t0) * height},
                                  {x + width, y + static_cast<float>(t1) * height}, above, above, below,
                                  below);
  }
  list->AddRect({x, y}, {x + width, y + height}, kLine);
  const double step = nice_ceiling(style.range_mm / 5);
  for (int i = 0; i * step <= style.range_mm * (1 + 1e-9); ++i) {
    const float at = y + static_cast<float>(i * step / style.range_mm) * height;
    list->AddLine({x + width, at}, {x + width + 4 * scale, at}, kLine);
    const std::string text = number(i * step, step);
    list->AddText({x + width + 8 * scale, at - ImGui::GetFontSize() / 2}, kText, text.c_str());
  }
  centred_text(list, {x + width / 2 + 6 * scale, y - 18 * scale}, "depth [mm]");
  const float middle = x + width / 2 + 6 * scale;
  if (automatic) centred_text(list, {middle, y + height + 13 * scale}, "auto", kLine);
  char grid[32];
  std::snprintf(grid, sizeof grid, "grid %g mm", style.grid_mm);
  if (style.grid_mm > 0)
    centred_text(list, {middle, y + height + (automatic ? 31 : 13) * scale}, grid, kLine);
}

void draw_contact(ImDrawList* list, const ViewRect& rect, const Touch& touch, const Sensor& sensor,
                  uint32_t image_width, double full_shear_N, float scale) {
  if (!touch.contact || !std::isfinite(touch.centroid_x_px)) return;
  const double zoom = static_cast<double>(rect.width) / image_width;
  const ImVec2 low{static_cast<float>(rect.x), static_cast<float>(rect.y)};
  const ImVec2 high{low.x + static_cast<float>(rect.width), low.y + static_cast<float>(rect.height)};
  list->PushClipRect(low, high);
  // Pixel (0, 0) has its centre at 0, its corner at -0.5.
  const ImVec2 centre{low.x + static_cast<float>((touch.centroid_x_px + 0.5) * zoom),
                      low.y + static_cast<float>((touch.centroid_y_px + 0.5) * zoom)};
  const double px_per_mm = zoom / sensor.pitch_mm_per_px;  // NaN without a scale: no outline then
  const double a = 0.5 * touch.ellipse.major_mm * px_per_mm, b = 0.5 * touch.ellipse.minor_mm * px_per_mm;
  const double c = std::cos(touch.ellipse.angle_rad), s = std::sin(touch.ellipse.angle_rad);
  std::array<ImVec2, 64> outline;
  for (size_t i = 0; i < outline.size(); ++i) {
    const double phase = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(outline.size());
    const double u = a * std::cos(phase), v = b * std::sin(phase);
    outline[i] = {centre.x + static_cast<float>(c * u - s * v), centre.y + static_cast<float>(s * u + c * v)};
  }
  if (std::isfinite(a)) {
    list->AddPolyline(outline.data(), static_cast<int>(outline.size()), kShadow, ImDrawFlags_Closed,
                      3.5f * scale);
    list->AddPolyline(outline.data(), static_cast<int>(outline.size()), kMarker, ImDrawFlags_Closed,
                      1.6f * scale);
  }
  const float arm = 6 * scale;
  list->AddLine({centre.x - arm, centre.y}, {centre.x + arm, centre.y}, kMarker, 1.6f * scale);
  list->AddLine({centre.x, centre.y - arm}, {centre.x, centre.y + arm}, kMarker, 1.6f * scale);

  const bool calibrated = touch.shear_x_N.validity != Validity::NotCalibrated;
  const double shear_N = std::hypot(touch.shear_x_N.value, touch.shear_y_N.value);
  if (calibrated && full_shear_N > 0 && shear_N > 0.05 * full_shear_N) {
    const double full_px = 0.3 * std::min(rect.width, rect.height);
    const ImVec2 reach{static_cast<float>(touch.shear_x_N.value / full_shear_N * full_px),
                       static_cast<float>(touch.shear_y_N.value / full_shear_N * full_px)};
    const ImVec2 tip{centre.x + reach.x, centre.y + reach.y};
    const float length = std::hypot(reach.x, reach.y);
    const ImVec2 along{reach.x / length, reach.y / length};
    const float head = std::min(9 * scale, length);
    list->AddLine(centre, tip, kShadow, 4.5f * scale);
    list->AddLine(centre, tip, kArrow, 2.5f * scale);
    list->AddTriangleFilled(
        tip, {tip.x - head * (along.x + 0.5f * along.y), tip.y - head * (along.y - 0.5f * along.x)},
        {tip.x - head * (along.x - 0.5f * along.y), tip.y - head * (along.y + 0.5f * along.x)}, kArrow);
  }
  list->PopClipRect();
}

}  // namespace palpate::viz
