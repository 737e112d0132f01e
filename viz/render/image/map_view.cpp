#include "viz/render/image/map_view.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "viz/look/measures.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

constexpr ImU32 kShadow = IM_COL32(0, 0, 0, 190);
constexpr ImU32 kWay = IM_COL32(255, 255, 255, 150), kPad = IM_COL32(120, 230, 170, 255),
                kFound = IM_COL32(255, 130, 90, 255), kNext = IM_COL32(120, 200, 255, 255);

/// Rooms too low for words and bar have the picture alone.
bool has_words(const ViewRect& room, float scale) {
  return static_cast<float>(room.height) >= 120 * scale && static_cast<float>(room.width) >= 150 * scale;
}

/// Of words above the picture; a narrow room has three.
size_t lines_of(const ViewRect& room, float scale) {
  return static_cast<float>(room.width) < 360 * scale ? 3 : 2;
}

/// Height of a line of words, the space to the next in it.
float line_px(float scale) {
  return (kBody_px + kGrid_px / 2) * scale;
}

void draw_lines(ImDrawList* list, const MapFit& fit, const std::vector<std::array<double, 2>>& places,
                ImU32 colour, bool closed, float scale) {
  std::vector<ImVec2> line;
  for (const auto& [x, y] : places) {
    const auto [u, v] = fit.at(x, y);
    line.push_back({u, v});
  }
  const auto count = static_cast<int>(line.size());
  const ImDrawFlags flags = closed ? ImDrawFlags_Closed : ImDrawFlags_None;
  list->AddPolyline(line.data(), count, kShadow, flags, 3 * scale);
  list->AddPolyline(line.data(), count, colour, flags, 1.5f * scale);
}

/// A round length at the picture's right foot.
void draw_length(ImDrawList* list, const MapFit& fit, float y, float scale) {
  const ViewRect& view = fit.picture;
  const double length_mm = nice_ceiling(0.12 * view.width / fit.px_per_mm);
  const auto length = static_cast<float>(length_mm * fit.px_per_mm);
  const std::string words = text("%g mm", length_mm);
  const float right = far_corner(view).x, middle = y + ImGui::GetFontSize() / 2;
  const float left = right - length, words_x = left - ImGui::CalcTextSize(words.c_str()).x - kGrid_px * scale;
  list->AddText({words_x, y}, ink(theme().text), words.c_str());
  list->AddLine({left, middle}, {right, middle}, ink(theme().text), 2 * scale);
  for (const float x : {left, right})
    list->AddLine({x, middle - 4 * scale}, {x, middle + 4 * scale}, ink(theme().text), scale);
}

/// The colours with the heights at their ends, at the picture's left foot.
void draw_heights(ImDrawList* list, const MapLook& look, const MapFit& fit, float y, ColourMap colours,
                  float scale) {
  const SeenMap& map = *look.map;
  constexpr int kBands = 32;
  const double step = std::max(map.high_mm - map.low_mm, 1e-3) / 20;
  const std::string low = tick_text(map.low_mm, step), high = tick_text(map.high_mm, step) + " " + look.unit;
  const float gap = kGrid_px / 2 * scale, height = kGrid_px * scale,
              width = std::min(100 * scale, 0.25f * size_of(fit.picture).x);
  float x = corner(fit.picture).x;
  list->AddText({x, y}, ink(theme().faint), low.c_str());
  x += ImGui::CalcTextSize(low.c_str()).x + gap;
  const float top = y + (ImGui::GetFontSize() - height) / 2;
  for (int i = 0; i < kBands; ++i) {
    const auto [red, green, blue] = colour_of(colours, (i + 0.5) / kBands);
    const float left = x + width * static_cast<float>(i) / kBands;
    list->AddRectFilled({left, top}, {left + width / kBands + 1, top + height},
                        ImGui::ColorConvertFloat4ToU32({red, green, blue, 1}));
  }
  list->AddText({x + width + gap, y}, ink(theme().faint), high.c_str());
}

}  // namespace

bool MapFit::operator==(const MapFit& o) const {
  return picture.x == o.picture.x && picture.y == o.picture.y && picture.width == o.picture.width &&
         picture.height == o.picture.height && px_per_mm == o.px_per_mm && x_mm == o.x_mm && y_mm == o.y_mm;
}

std::array<float, 2> MapFit::at(double x, double y) const {
  return {static_cast<float>(picture.x + 0.5 * picture.width + (x - x_mm) * px_per_mm),
          static_cast<float>(picture.y + 0.5 * picture.height + (y - y_mm) * px_per_mm)};
}

MapFit fit_map(const SeenMap* map, const ViewRect& room, const MapEye& eye, float scale) {
  const float margin = kGrid_px * scale, words = has_words(room, scale) ? line_px(scale) : 0;
  MapFit fit;
  // Words above it, bar and length below it.
  const float above = words * static_cast<float>(lines_of(room, scale));
  fit.picture = rect_of(corner(room).x + margin, corner(room).y + margin + above,
                        size_of(room).x - 2 * margin, size_of(room).y - 2 * margin - above - words);
  if (!map || map->width == 0) return fit;
  if (!eye.all) {
    fit.px_per_mm = eye.px_per_mm;
    fit.x_mm = eye.x_mm;
    fit.y_mm = eye.y_mm;
    return fit;
  }
  const double width_mm = map->width * map->pitch_mm, height_mm = map->height * map->pitch_mm;
  fit.px_per_mm = std::min(fit.picture.width / width_mm, fit.picture.height / height_mm);
  fit.x_mm = map->left_mm + 0.5 * (map->width - 1) * map->pitch_mm;
  fit.y_mm = map->top_mm + 0.5 * (map->height - 1) * map->pitch_mm;
  return fit;
}

std::vector<std::string> map_words(const MapLook& look, float width_px) {
  std::vector<std::string> parts = look.words;
  const bool sentence = parts.empty() && (!look.map || look.map->width == 0);
  if (sentence) {
    parts = {"no map yet:", "it grows while", "the pad moves", "over an object", "that has texture"};
  } else if (parts.empty()) {
    const SeenMap& m = *look.map;
    parts = {text("map %.0f mm\xc2\xb2", m.covered_mm2)};
    parts.push_back(std::isnan(m.error_mm) ? std::string("error not known")
                                           : text("\xc2\xb1 %.2g mm", m.error_mm));
    parts.push_back(text("%u key frame%s", m.keys, m.keys == 1 ? "" : "s"));
    parts.push_back(text("%u loop%s", m.closed, m.closed == 1 ? "" : "s"));
    if (m.pieces > 1) parts.push_back(text("largest of %u pieces", m.pieces));
    if (m.missed > 0) parts.emplace_back("full");
  }
  std::vector<std::string> lines;
  for (const std::string& part : parts) {
    const std::string longer = lines.empty() ? part : lines.back() + (sentence ? " " : ", ") + part;
    if (!lines.empty() && ImGui::CalcTextSize(longer.c_str()).x <= width_px)
      lines.back() = longer;
    else
      lines.push_back(lines.empty() ? longer : part);
  }
  return lines;
}

void draw_map_marks(ImDrawList* list, const ViewRect& room, const MapLook& look, const MapEye& eye,
                    ColourMap colours, float scale) {
  const MapFit fit = fit_map(look.map.get(), room, eye, scale);
  const ViewRect& view = fit.picture;
  list->AddRect({corner(view).x - 1, corner(view).y - 1}, {far_corner(view).x + 1, far_corner(view).y + 1},
                ink(theme().frame));
  const bool has_map = look.map && look.map->width > 0;
  if (has_map) {
    list->PushClipRect(corner(view), far_corner(view), true);
    draw_lines(list, fit, look.map->way_mm, kWay, false, scale);
    if (!look.pad_mm.empty()) draw_lines(list, fit, look.pad_mm, kPad, true, scale);
    for (const auto& outline : look.outlines_mm) draw_lines(list, fit, outline, kFound, true, scale);
    if (!look.next_mm.empty()) draw_lines(list, fit, look.next_mm, kNext, true, scale);
    list->PopClipRect();
  }
  if (!has_words(room, scale)) return;
  const float left = corner(view).x, gap = kGrid_px / 2 * scale;
  std::vector<std::string> lines = map_words(look, size_of(view).x);
  lines.resize(std::min(lines.size(), lines_of(room, scale)));
  for (size_t k = 0; k < lines.size(); ++k)
    list->AddText({left, corner(room).y + gap + static_cast<float>(k) * line_px(scale)},
                  ink(k == 0 ? theme().text : theme().faint), lines[k].c_str());
  if (!has_map) return;
  const float foot = far_corner(view).y + gap;
  draw_heights(list, look, fit, foot, colours, scale);
  draw_length(list, fit, foot, scale);
}

void paint_map(Frame& picture, const SeenMap* map, const MapFit& fit, ColourMap colours) {
  const uint32_t width = fit.picture.width, height = fit.picture.height;
  picture.reshape({width, height, 3, 8});
  const Rgb ground = theme().chart;
  const size_t plane = picture.format.plane_bytes();
  const std::array<uint8_t, 3> empty{ground.red, ground.green, ground.blue};
  for (size_t c = 0; c < 3; ++c)
    std::fill_n(picture.bytes.begin() + static_cast<std::ptrdiff_t>(c * plane), plane, empty[c]);
  if (!map || map->width == 0) return;
  constexpr int kColours = 256;
  std::vector<std::array<uint8_t, 3>> table;
  for (int i = 0; i < kColours; ++i) {
    const std::array<float, 3> colour = colour_of(colours, i / (kColours - 1.0));
    std::array<uint8_t, 3>& entry = table.emplace_back();
    for (size_t c = 0; c < 3; ++c) entry[c] = static_cast<uint8_t>(std::lround(255 * colour[c]));
  }
  const double range = std::max(map->high_mm - map->low_mm, 1e-6);
  const auto nearest = [](double mm, double first_mm, double pitch_mm, uint32_t count) {
    const double at = std::floor((mm - first_mm) / pitch_mm + 0.5);
    return at >= 0 && at < count ? static_cast<int64_t>(at) : -1;
  };
  std::vector<int64_t> columns;
  for (uint32_t x = 0; x < width; ++x)
    columns.push_back(
        nearest(fit.x_mm + (x + 0.5 - 0.5 * width) / fit.px_per_mm, map->left_mm, map->pitch_mm, map->width));
  for (uint32_t y = 0; y < height; ++y) {
    const int64_t row =
        nearest(fit.y_mm + (y + 0.5 - 0.5 * height) / fit.px_per_mm, map->top_mm, map->pitch_mm, map->height);
    if (row < 0) continue;
    for (uint32_t x = 0; x < width; ++x) {
      if (columns[x] < 0) continue;
      const float z = map->height_mm[static_cast<size_t>(row) * map->width + static_cast<size_t>(columns[x])];
      if (std::isnan(z)) continue;
      const double share = std::clamp((double{z} - map->low_mm) / range, 0.0, 1.0);
      const auto& colour = table[static_cast<size_t>(std::lround(share * (kColours - 1)))];
      for (size_t c = 0; c < 3; ++c) picture.bytes[c * plane + size_t{y} * width + x] = colour[c];
    }
  }
}

void MapView::draw(VkCommandBuffer cmd, VkExtent2D extent, const MapLook& look, const MapFit& fit,
                   ColourMap colours, bool light_theme) {
  if (picture_.bytes.empty() || look.map != painted_ || !(fit == fit_) || colours != colours_ ||
      light_theme != light_theme_)
    paint_map(picture_, look.map.get(), fit, colours);
  painted_ = look.map;
  fit_ = fit;
  colours_ = colours;
  light_theme_ = light_theme;
  image_.draw(cmd, picture_, {}, fit.picture, extent);
}

}  // namespace palpate::viz
