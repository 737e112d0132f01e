#include "viz/render/annotations.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/statistics.h"
#include "engine/base/text.h"
#include "viz/look/measures.h"
#include "viz/render/colour_map.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

ImU32 map_colour(ColourMap map, double t) {
  const auto [red, green, blue] = colour_of(map, t);
  return ImGui::ColorConvertFloat4ToU32({red, green, blue, 1});
}

void centred_text(ImDrawList* list, ImVec2 at, const std::string& words, ImU32 colour = ink(theme().text)) {
  const ImVec2 size = ImGui::CalcTextSize(words.c_str());
  list->AddText({std::round(at.x - size.x / 2), std::round(at.y - size.y / 2)}, colour, words.c_str());
}

// Draws lines and labels given in world mm.
class Pen {
 public:
  /// `beside_px`: at the right end, without labels.
  Pen(ImDrawList* list, const Eye& eye, const ViewRect& rect, float beside_px = 0)
      : list_(list), eye_(eye), rect_(rect), right_(far_corner(rect).x - beside_px) {}

  bool at(const Vec3& world, ImVec2& screen) const {
    const Projected p = eye_.project(world);
    screen = {static_cast<float>(rect_.x + p.x * rect_.width),
              static_cast<float>(rect_.y + p.y * rect_.height)};
    return p.in_front;
  }
  void line(const Vec3& a, const Vec3& b, float width) const {
    ImVec2 from, to;
    if (at(a, from) && at(b, to)) list_->AddLine(from, to, ink(theme().faint), width);
  }
  // The label sits beyond `world`, on the side away from `inside`, by as many pixels whatever the zoom; false
  // where another stands there.
  bool label(const Vec3& world, const Vec3& inside, float away_px, const std::string& words) {
    ImVec2 p, q;
    if (!at(world, p) || !at(inside, q)) return false;
    const float dx = p.x - q.x, dy = p.y - q.y;
    const float length = std::max(std::hypot(dx, dy), 1e-3f);
    return label({p.x + dx / length * away_px, p.y + dy / length * away_px}, words);
  }
  // The same in the middle of a place on the screen.
  bool label(ImVec2 middle, const std::string& words) {
    constexpr float kApart_px = 3, kEdge_px = 4;
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const float beyond = middle.x + size.x / 2 - right_;
    if (beyond > size.x) return false;
    middle.x -= std::max(beyond, 0.0f);
    const float before = corner(rect_).x + kEdge_px - (middle.x - size.x / 2);
    if (before > size.x) return false;
    middle.x += std::max(before, 0.0f);
    const PlacedText text{words, middle.x - size.x / 2, middle.y - size.y / 2, middle.x + size.x / 2,
                          middle.y + size.y / 2};
    for (const PlacedText& other : placed_)
      if (text.left < other.right + kApart_px && other.left < text.right + kApart_px &&
          text.top < other.bottom && other.top < text.bottom)
        return false;
    placed_.push_back(text);
    centred_text(list_, middle, words);
    return true;
  }
  std::vector<PlacedText> placed() { return std::move(placed_); }

 private:
  ImDrawList* list_;
  const Eye& eye_;
  const ViewRect& rect_;
  float right_;
  std::vector<PlacedText> placed_;
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

// Pressure or shear of a cell, kPa.
float load_of(const TractionMaps& maps, TractionArrows shown, size_t i) {
  return shown == TractionArrows::Pressure ? maps.pressure_kPa[i]
                                           : std::hypot(maps.shear_x_kPa[i], maps.shear_y_kPa[i]);
}

// A single cell at the rim does not set the length of all arrows.
float long_load_kPa(const TractionMaps& maps, TractionArrows shown) {
  constexpr double kBelow = 0.98;
  std::vector<float> kPa;
  const size_t cells = shown == TractionArrows::Pressure ? maps.pressure_kPa.size() : maps.shear_x_kPa.size();
  for (size_t i = 0; i < cells; ++i)
    if (const float one = load_of(maps, shown, i); one > 0) kPa.push_back(one);
  return quantile_in_place(kPa, kBelow);
}

constexpr ImU32 kLoad = IM_COL32(255, 255, 255, 235), kSlips = IM_COL32(255, 120, 60, 255);  // on any map

}  // namespace

void draw_traction(ImDrawList* list, const Eye& eye, const ViewRect& view, const Vec3& half_mm,
                   const TractionMaps& maps, TractionArrows shown, double friction, float scale) {
  const double long_kPa = shown == TractionArrows::Off ? 0 : double{long_load_kPa(maps, shown)};
  if (!(long_kPa > 0)) return;
  const double full_kPa = scale_ceiling(long_kPa);
  constexpr uint32_t kAcross = 22;
  constexpr double kShortest = 0.06, kLongest = 1.2;  // of the arrow that the text names
  const bool pressure = shown == TractionArrows::Pressure;
  const std::vector<float> ratios = pressure ? std::vector<float>{} : friction_ratios(maps);
  const uint32_t step = std::max(1u, maps.width / kAcross);
  const double cell_mm = 2 * half_mm.x / maps.width, length_mm = (pressure ? 2.4 : 1.6) * step * cell_mm;
  list->PushClipRect(corner(view), far_corner(view));
  const Pen pen(list, eye, view);
  bool slips = false;
  for (uint32_t y = step / 2; y < maps.height; y += step)
    for (uint32_t x = step / 2; x < maps.width; x += step) {
      const size_t i = size_t{y} * maps.width + x;
      const double share = double{load_of(maps, shown, i)} / full_kPa;
      if (share < kShortest) continue;
      const double along_mm = length_mm * std::min(share, kLongest);
      const Vec3 on_pad{(x + 0.5) * cell_mm - half_mm.x, half_mm.y - (y + 0.5) * cell_mm, 0};
      const Vec3 along = pressure ? Vec3{0, 0, -1}
                                  : Vec3{double{maps.shear_x_kPa[i]}, -double{maps.shear_y_kPa[i]}, 0} *
                                        (1 / (share * full_kPa));
      const Vec3 from = pressure ? on_pad - along * along_mm : on_pad;
      ImVec2 a, b;
      if (!pen.at(from, a) || !pen.at(from + along * along_mm, b)) continue;
      const bool at_limit = !pressure && friction > 0 && double{ratios[i]} >= kSlippingShare * friction;
      slips = slips || at_limit;
      draw_arrow(list, a, b, at_limit ? kSlips : kLoad, scale);
    }
  const float x = corner(view).x + 14 * scale, y = corner(view).y + 10 * scale, row = ImGui::GetFontSize();
  const Vec3 key = pressure ? Vec3{0, 0, length_mm} : Vec3{length_mm, 0, 0};
  ImVec2 a, b;
  if (pen.at(key * 0.5, a) && pen.at(key * -0.5, b)) {
    const float key_px = std::hypot(b.x - a.x, b.y - a.y);
    const ImVec2 reach = pressure ? ImVec2{0, key_px} : ImVec2{key_px, 0};
    const ImVec2 from{x + (pressure ? 4 * scale : 0), y + (pressure ? 0 : row / 2)};
    draw_arrow(list, from, {from.x + reach.x, from.y + reach.y}, ink(theme().text), scale);
    list->AddText({from.x + reach.x + 8 * scale, y}, ink(theme().text),
                  text("%s %.3g kPa", to_string(shown), full_kPa).c_str());
  }
  if (slips) list->AddText({x, y + 1.3f * row}, ink(theme().slips), "at the friction limit");
  list->PopClipRect();
}

namespace {

// Depth hangs from the lower of the two outer corners: nothing hides it there.
void draw_depth_axis(Pen& pen, const Eye& eye, const Vec3& corner, double tick, const SurfaceStyle& style,
                     float scale) {
  const double side = dot(corner, eye.right) < 0 ? -1 : 1;
  const double step = nice_ceiling(style.range_mm / 4);
  const auto below = [&](double depth_mm) { return corner + Vec3{0, 0, -depth_mm * style.exaggeration}; };
  const Vec3 outward = eye.right * (side * tick);
  pen.line(corner, below(style.range_mm), scale);
  ImVec2 foot, head;
  if (!pen.at(corner, head) || !pen.at(below(style.range_mm), foot)) return;
  // Seen from above the axis is short: of close numbers every second, or third.
  const double apart_px =
      step / style.range_mm * std::hypot(double{foot.x} - double{head.x}, double{foot.y} - double{head.y});
  const int stride = std::max(
      1, static_cast<int>(std::ceil(1.05 * double{ImGui::GetFontSize()} / std::max(apart_px, 0.01))));
  const int last = static_cast<int>(std::floor(style.range_mm / step + 1e-9));
  // From the deepest, which has a number.
  for (int i = last; i >= 0; --i) {
    const double d = i * step;
    pen.line(below(d), below(d) + outward, scale);
    ImVec2 end;
    if (i == 0 || (last - i) % stride != 0 || !pen.at(below(d) + outward, end)) continue;
    // Clear of the tick however many figures it has.
    const std::string words = tick_text(d, step);
    const float half = ImGui::CalcTextSize(words.c_str()).x / 2;
    pen.label({end.x + static_cast<float>(side) * (half + 5 * scale), end.y}, words);
  }
  const std::string title = text("depth [mm] x%.3g", style.exaggeration);
  for (const float rows : {1.0f, 2.0f, 3.0f})
    if (pen.label({foot.x, foot.y + rows * ImGui::GetFontSize()}, title)) break;
}

}  // namespace

std::vector<PlacedText> draw_axes(ImDrawList* list, const Eye& eye, const ViewRect& view, const Vec3& half_mm,
                                  const SurfaceStyle& style, float scale) {
  list->PushClipRect(corner(view), far_corner(view));
  Pen pen(list, eye, view, static_cast<float>(kColourBarRoom_px) * scale);
  const double side_x = eye.backward.x >= 0 ? 1 : -1, side_y = eye.backward.y >= 0 ? 1 : -1;
  const double step = nice_ceiling(std::max(half_mm.x, half_mm.y) / 3.5);
  const double tick = 0.025 * std::max(half_mm.x, half_mm.y);
  const float near_px = 15 * scale, far_px = 34 * scale;
  const double y = side_y * half_mm.y, x = side_x * half_mm.x;

  if (std::abs(eye.backward.z) < 0.97) {
    const Vec3 a{-x, y, 0}, b{x, -y, 0};
    draw_depth_axis(pen, eye, eye.project(a).y > eye.project(b).y ? a : b, tick, style, scale);
  }
  const auto along_x = [&](double v, float away_px, const std::string& words) {
    return pen.label({v, y + side_y * tick, 0}, {v, -y, 0}, away_px, words);
  };
  const auto along_y = [&](double v, float away_px, const std::string& words) {
    return pen.label({x + side_x * tick, v, 0}, {-x, v, 0}, away_px, words);
  };
  // From the middle outwards: where the axes meet, the outer numbers give way.
  const auto outwards = [step](double half, const auto& draw) {
    for (int i = 0; i * step <= half * (1 + 1e-9); ++i) {
      draw(i * step);
      if (i > 0) draw(-i * step);
    }
  };
  pen.line({-half_mm.x, y, 0}, {half_mm.x, y, 0}, scale);
  outwards(half_mm.x, [&](double v) {
    pen.line({v, y, 0}, {v, y + side_y * tick, 0}, scale);
    along_x(v, near_px, tick_text(v, step));
  });
  pen.line({x, -half_mm.y, 0}, {x, half_mm.y, 0}, scale);
  outwards(half_mm.y, [&](double v) {
    pen.line({x, v, 0}, {x + side_x * tick, v, 0}, scale);
    along_y(v, near_px, tick_text(-v, step));
  });
  // Titles stand between two numbers, or beyond them: the first place that is free.
  const auto entitle = [&](const auto& along, const std::string& title) {
    for (const float away_px : {far_px, 1.4f * far_px})
      for (const double between : {0.5, -0.5, 1.5, -1.5})
        if (along(between * step, away_px, title)) return;
  };
  entitle(along_x, "x [mm]");
  entitle(along_y, "y [mm]");
  list->PopClipRect();
  return pen.placed();
}

namespace {

/// Of the colours' quantity as it is shown.
struct ColourUnit {
  const char *title, *unit;
  double factor;  ///< from the unit of `last_colour`
};
ColourUnit unit_of(Quantity quantity) {
  switch (quantity) {
    case Quantity::Pressure:
      return {"p", "kPa", 1e3};
    case Quantity::Strain:
      return {"strain", "%", 100};
    case Quantity::Friction:
      return {"shear / p", "", 1};
    default:
      return {"depth", "mm", 1};
  }
}

}  // namespace

void draw_colour_bar(ImDrawList* list, const ViewRect& rect, const SurfaceStyle& style, bool automatic,
                     float scale) {
  constexpr int kBands = 64;
  const float width = 16 * scale;
  const float height = std::min(0.42f * size_of(rect).y, std::max(280 * scale, 0.25f * size_of(rect).y));
  const float x = far_corner(rect).x - 72 * scale;
  const float y = corner(rect).y + 44 * scale;
  for (int i = 0; i < kBands; ++i) {
    const double t0 = static_cast<double>(i) / kBands, t1 = static_cast<double>(i + 1) / kBands;
    const ImU32 above = map_colour(style.map, t0), below = map_colour(style.map, t1);
    list->AddRectFilledMultiColor({x, y + static_cast<float>(t0) * height},
                                  {x + width, y + static_cast<float>(t1) * height}, above, above, below,
                                  below);
  }
  list->AddRect({x, y}, {x + width, y + height}, ink(theme().faint));
  const ColourUnit unit = unit_of(style.quantity);
  const double range = unit.factor * last_colour(style);
  const double step = nice_ceiling(range / 5);
  for (int i = 0; i * step <= range * (1 + 1e-9); ++i) {
    const float at = y + static_cast<float>(i * step / range) * height;
    list->AddLine({x + width, at}, {x + width + 4 * scale, at}, ink(theme().faint));
    const std::string words = tick_text(i * step, step);
    list->AddText({x + width + 8 * scale, at - ImGui::GetFontSize() / 2}, ink(theme().text), words.c_str());
  }
  const float middle = x + width / 2 + 6 * scale;
  const std::string title = *unit.unit ? text("%s [%s]", unit.title, unit.unit) : unit.title;
  centred_text(list, {middle, y - 18 * scale}, title);
  float below = y + height + 13 * scale;
  if (automatic) {
    centred_text(list, {middle, below}, "auto", ink(theme().faint));
    below += 18 * scale;
  }
  if (style.grid_mm > 0)
    centred_text(list, {middle, below}, text("grid %g mm", style.grid_mm), ink(theme().faint));
}

void draw_low_colour_bar(ImDrawList* list, const ViewRect& rect, const SurfaceStyle& style, float scale) {
  constexpr int kBands = 32;
  const ColourUnit unit = unit_of(style.quantity);
  const std::string words = text("%s 0 to %.3g %s", unit.title, unit.factor * last_colour(style), unit.unit);
  const float width = std::min(120 * scale, 0.4f * size_of(rect).x), height = 8 * scale;
  const float y = far_corner(rect).y - ImGui::GetFontSize() - kGrid_px / 2 * scale;
  const float x = corner(rect).x + kGrid_px * scale, bar_y = y + (ImGui::GetFontSize() - height) / 2;
  for (int i = 0; i < kBands; ++i) {
    const float left = x + width * static_cast<float>(i) / kBands;
    list->AddRectFilled({left, bar_y}, {left + width / kBands + 1, bar_y + height},
                        map_colour(style.map, (i + 0.5) / kBands));
  }
  list->AddText({x + width + kGrid_px * scale, y}, ink(theme().faint), words.c_str());
}

}  // namespace palpate::viz
