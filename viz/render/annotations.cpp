#include "viz/render/annotations.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

#include "engine/base/text.h"
#include "viz/render/colour_map.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

constexpr ImU32 kLine = IM_COL32(170, 178, 190, 255);
constexpr ImU32 kText = IM_COL32(205, 211, 220, 255);

ImU32 map_colour(ColourMap map, double t) {
  const auto [red, green, blue] = colour_of(map, t);
  return ImGui::ColorConvertFloat4ToU32({red, green, blue, 1});
}

void centred_text(ImDrawList* list, ImVec2 at, const std::string& words, ImU32 colour = kText) {
  const ImVec2 size = ImGui::CalcTextSize(words.c_str());
  list->AddText({std::round(at.x - size.x / 2), std::round(at.y - size.y / 2)}, colour, words.c_str());
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
  void label(const Vec3& world, const Vec3& inside, float away_px, const std::string& words) const {
    ImVec2 p, q;
    if (!at(world, p) || !at(inside, q)) return;
    const float dx = p.x - q.x, dy = p.y - q.y;
    const float length = std::max(std::hypot(dx, dy), 1e-3f);
    centred_text(list_, {p.x + dx / length * away_px, p.y + dy / length * away_px}, words);
  }

 private:
  ImDrawList* list_;
  const Eye& eye_;
  const ViewRect& rect_;
};

}  // namespace

namespace {

// One arrow, dark under bright so that it is seen on every colour.
void draw_arrow(ImDrawList* list, ImVec2 a, ImVec2 b, ImU32 colour, float scale) {
  const float dx = b.x - a.x, dy = b.y - a.y, length = std::max(std::hypot(dx, dy), 1e-3f);
  const float head = std::min(5 * scale, 0.5f * length), ux = dx / length, uy = dy / length;
  for (const auto& [tint, width] :
       {std::pair{IM_COL32(0, 0, 0, 160), 3 * scale}, std::pair{colour, 1.4f * scale}}) {
    list->AddLine(a, b, tint, width);
    list->AddLine(b, {b.x - head * (ux + 0.6f * uy), b.y - head * (uy - 0.6f * ux)}, tint, width);
    list->AddLine(b, {b.x - head * (ux - 0.6f * uy), b.y - head * (uy + 0.6f * ux)}, tint, width);
  }
}

// A single cell at the rim does not set the length of all arrows.
float long_shear_kPa(const TractionMaps& maps) {
  constexpr double kBelow = 0.98;
  std::vector<float> kPa;
  for (size_t i = 0; i < maps.shear_x_kPa.size(); ++i)
    if (const float one = std::hypot(maps.shear_x_kPa[i], maps.shear_y_kPa[i]); one > 0) kPa.push_back(one);
  if (kPa.empty()) return 0;
  const auto at = kPa.begin() + static_cast<ptrdiff_t>(kBelow * static_cast<double>(kPa.size() - 1));
  std::nth_element(kPa.begin(), at, kPa.end());
  return *at;
}

}  // namespace

void draw_shear(ImDrawList* list, const Eye& eye, const ViewRect& clip, const ViewRect& view,
                const Vec3& half_mm, const TractionMaps& maps, double friction, float scale) {
  const double long_kPa = double{long_shear_kPa(maps)};
  if (!(long_kPa > 0)) return;
  const double full_kPa = scale_ceiling(long_kPa);
  constexpr uint32_t kAcross = 22;
  constexpr double kShortest = 0.06, kLongest = 1.2;  // of the arrow that the text names
  constexpr ImU32 kSticks = IM_COL32(255, 255, 255, 235), kSlips = IM_COL32(255, 120, 60, 255);
  const std::vector<float> ratios = friction_ratios(maps);
  const uint32_t step = std::max(1u, maps.width / kAcross);
  const double cell_mm = 2 * half_mm.x / maps.width, length_mm = 1.6 * step * cell_mm;
  const auto left = static_cast<float>(clip.x), top = static_cast<float>(clip.y);
  list->PushClipRect({left, top},
                     {left + static_cast<float>(clip.width), top + static_cast<float>(clip.height)});
  const Pen pen(list, eye, view);
  bool slips = false;
  for (uint32_t y = step / 2; y < maps.height; y += step)
    for (uint32_t x = step / 2; x < maps.width; x += step) {
      const size_t i = size_t{y} * maps.width + x;
      const double tx = double{maps.shear_x_kPa[i]} / full_kPa, ty = double{maps.shear_y_kPa[i]} / full_kPa;
      const double share = std::hypot(tx, ty);
      if (share < kShortest) continue;
      const double along_mm = length_mm * std::min(1.0, kLongest / share);
      const Vec3 from{(x + 0.5) * cell_mm - half_mm.x, half_mm.y - (y + 0.5) * cell_mm, 0};
      ImVec2 a, b;
      if (!pen.at(from, a) || !pen.at({from.x + along_mm * tx, from.y - along_mm * ty, 0}, b)) continue;
      const bool at_limit = friction > 0 && double{ratios[i]} >= kSlippingShare * friction;
      slips = slips || at_limit;
      draw_arrow(list, a, b, at_limit ? kSlips : kSticks, scale);
    }
  const float x = left + 14 * scale, y = top + 10 * scale;
  ImVec2 a, b;
  if (pen.at({-0.5 * length_mm, 0, 0}, a) && pen.at({0.5 * length_mm, 0, 0}, b)) {
    const float key_px = std::hypot(b.x - a.x, b.y - a.y), middle = y + 0.5f * ImGui::GetFontSize();
    draw_arrow(list, {x, middle}, {x + key_px, middle}, kSticks, scale);
    list->AddText({x + key_px + 8 * scale, y}, kText, text("shear %.3g kPa", full_kPa).c_str());
  }
  if (slips) list->AddText({x, y + 1.3f * ImGui::GetFontSize()}, kSlips, "at the friction limit");
  list->PopClipRect();
}

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
    pen.label({v, y + side_y * tick, 0}, {v, y - side_y * half_mm.y, 0}, near_px, tick_text(v, step));
  }
  const double between = 0.5 * step;  // titles stand between two numbers
  pen.label({between, y + side_y * tick, 0}, {between, y - side_y * half_mm.y, 0}, far_px, "x [mm]");
  pen.line({x, -half_mm.y, 0}, {x, half_mm.y, 0}, scale);
  for (double v = -std::floor(half_mm.y / step) * step; v <= half_mm.y + 1e-9; v += step) {
    pen.line({x, v, 0}, {x + side_x * tick, v, 0}, scale);
    pen.label({x + side_x * tick, v, 0}, {x - side_x * half_mm.x, v, 0}, near_px, tick_text(-v, step));
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
    float last_y = -1e6f;
    for (double d = 0; d <= style.range_mm * (1 + 1e-9); d += depth_step) {
      pen.line(below(d), below(d) + outward, scale);
      ImVec2 at;
      // Seen from above the axis is short: no number over another.
      if (d <= 0 || !pen.at(below(d), at) || std::abs(at.y - last_y) < 0.9f * ImGui::GetFontSize()) continue;
      last_y = at.y;
      pen.label(below(d) + outward, below(d), near_px, tick_text(d, depth_step));
    }
    const std::string title = text("depth [mm] x%.3g", style.exaggeration);
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
    const ImU32 above = map_colour(style.map, t0), below = map_colour(style.map, t1);
    list->AddRectFilledMultiColor({x, y + static_cast<float>(t0) * height},
                                  {x + width, y + static_cast<float>(t1) * height}, above, above, below,
                                  below);
  }
  list->AddRect({x, y}, {x + width, y + height}, kLine);
  const double unit = style.quantity == Quantity::Pressure ? 1e3
                      : style.quantity == Quantity::Strain ? 100
                                                           : 1;
  const double range = unit * last_colour(style);
  const double step = nice_ceiling(range / 5);
  for (int i = 0; i * step <= range * (1 + 1e-9); ++i) {
    const float at = y + static_cast<float>(i * step / range) * height;
    list->AddLine({x + width, at}, {x + width + 4 * scale, at}, kLine);
    const std::string words = tick_text(i * step, step);
    list->AddText({x + width + 8 * scale, at - ImGui::GetFontSize() / 2}, kText, words.c_str());
  }
  const float middle = x + width / 2 + 6 * scale;
  const char* title = style.quantity == Quantity::Pressure   ? "p [kPa]"
                      : style.quantity == Quantity::Strain   ? "strain [%]"
                      : style.quantity == Quantity::Friction ? "shear / p"
                                                             : "depth [mm]";
  centred_text(list, {middle, y - 18 * scale}, title);
  float below = y + height + 13 * scale;
  if (automatic) {
    centred_text(list, {middle, below}, "auto", kLine);
    below += 18 * scale;
  }
  if (style.grid_mm > 0) centred_text(list, {middle, below}, text("grid %g mm", style.grid_mm), kLine);
}

}  // namespace palpate::viz
