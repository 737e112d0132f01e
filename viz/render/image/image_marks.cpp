// Marks over the raw image; declared in annotations.h.
#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "viz/render/annotations.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/layout.h"

namespace palpate::viz {
namespace {

constexpr ImU32 kMarker = IM_COL32(240, 190, 70, 255);
constexpr ImU32 kArrow = IM_COL32(92, 200, 255, 255);
constexpr ImU32 kSkin = IM_COL32(240, 140, 200, 235);
constexpr ImU32 kLost = IM_COL32(150, 150, 150, 160);
constexpr ImU32 kWarning = IM_COL32(255, 120, 60, 255);
constexpr ImU32 kLump = IM_COL32(0, 208, 148, 255);
constexpr ImU32 kShadow = IM_COL32(0, 0, 0, 170);

/// From pixels of the frame to the screen. Pixel (0, 0) has its centre at 0, its corner at -0.5.
struct Place {
  ImVec2 low;
  double zoom;
  ImVec2 at(double x_px, double y_px) const {
    return {low.x + static_cast<float>((x_px + 0.5) * zoom), low.y + static_cast<float>((y_px + 0.5) * zoom)};
  }
};

/// `at`: from pixels of the frame to the screen.
template <typename At>
void draw_ellipse(ImDrawList* list, const At& at, double x_px, double y_px, const Ellipse& ellipse,
                  bool at_border, float scale) {
  const double a = 0.5 * ellipse.major_px, b = 0.5 * ellipse.minor_px;
  const double c = std::cos(ellipse.angle_rad), s = std::sin(ellipse.angle_rad);
  std::array<ImVec2, 64> outline;
  for (size_t i = 0; i < outline.size(); ++i) {
    const double phase = 2 * std::numbers::pi * static_cast<double>(i) / static_cast<double>(outline.size());
    const double u = a * std::cos(phase), v = b * std::sin(phase);
    outline[i] = at(x_px + c * u - s * v, y_px + s * u + c * v);
  }
  list->AddPolyline(outline.data(), static_cast<int>(outline.size()), kShadow, ImDrawFlags_Closed,
                    3.5f * scale);
  if (!at_border) {
    list->AddPolyline(outline.data(), static_cast<int>(outline.size()), kMarker, ImDrawFlags_Closed,
                      1.6f * scale);
    return;
  }
  for (size_t i = 0; i < outline.size(); i += 2)  // broken: part of the contact is not seen
    list->AddLine(outline[i], outline[(i + 1) % outline.size()], kWarning, 1.8f * scale);
}

void draw_cross(ImDrawList* list, ImVec2 centre, float scale) {
  const float arm = 6 * scale;
  for (const auto& [colour, width] : {std::pair{kShadow, 3.2f * scale}, std::pair{kMarker, 1.6f * scale}}) {
    list->AddLine({centre.x - arm, centre.y}, {centre.x + arm, centre.y}, colour, width);
    list->AddLine({centre.x, centre.y - arm}, {centre.x, centre.y + arm}, colour, width);
  }
}

void draw_arrow(ImDrawList* list, ImVec2 from, ImVec2 reach, ImU32 colour, float width, float scale) {
  const float length = std::hypot(reach.x, reach.y);
  if (length < 1) return;
  const ImVec2 tip{from.x + reach.x, from.y + reach.y}, along{reach.x / length, reach.y / length};
  const float head = std::min(3.6f * width, length);
  list->AddLine(from, tip, kShadow, width + 2 * scale);
  list->AddLine(from, tip, colour, width);
  list->AddTriangleFilled(
      tip, {tip.x - head * (along.x + 0.5f * along.y), tip.y - head * (along.y - 0.5f * along.x)},
      {tip.x - head * (along.x - 0.5f * along.y), tip.y - head * (along.y + 0.5f * along.x)}, colour);
}

void draw_shear(ImDrawList* list, const ViewRect& rect, ImVec2 centre, const Estimate& x, const Estimate& y,
                const ImageMarks& marks) {
  if (x.validity == Validity::NotCalibrated || x.validity == Validity::NoContact) return;
  const double shear_N = std::hypot(x.value, y.value);
  if (!(marks.full_shear_N > 0) || !(shear_N > 0.05 * marks.full_shear_N)) return;
  const double px_per_N = 0.3 * std::min(rect.width, rect.height) / marks.full_shear_N;
  draw_arrow(list, centre, {static_cast<float>(x.value * px_per_N), static_cast<float>(y.value * px_per_N)},
             kArrow, 2.5f * marks.scale, marks.scale);
}

void draw_skin(ImDrawList* list, const Place& place, const Touch& touch, float scale) {
  // Shifts of a few tenths of a pixel are what there is to see: as long as makes the largest a third of the
  // points' distance, in steps so that lengths stay comparable.
  double largest = 0;
  for (const SkinPoint& p : touch.skin_points)
    if (p.correlation > 0) largest = std::max<double>(largest, std::hypot(p.shift_x_px, p.shift_y_px));
  double longer = 1;
  while (longer < 16 && largest * longer * 2 < 12) longer *= 2;
  for (const SkinPoint& p : touch.skin_points) {
    const ImVec2 at = place.at(p.rest_x_px, p.rest_y_px);
    if (!(p.correlation > 0)) {
      const float arm = 2.2f * scale;
      list->AddLine({at.x - arm, at.y - arm}, {at.x + arm, at.y + arm}, kLost, scale);
      list->AddLine({at.x - arm, at.y + arm}, {at.x + arm, at.y - arm}, kLost, scale);
      continue;
    }
    const auto k = static_cast<float>(longer * place.zoom);
    const ImVec2 tip{at.x + p.shift_x_px * k, at.y + p.shift_y_px * k};
    list->AddLine(at, tip, kSkin, 1.2f * scale);
    list->AddCircleFilled(tip, 1.7f * scale, kSkin, 6);
  }
  shadowed_text(list, {place.low.x + 5 * scale, place.low.y + 3 * scale}, kSkin,
                text("skin shift x%g", longer));
}

/// Seen on bright and on dark ground.
void stroke(ImDrawList* list, ImVec2 from, ImVec2 to, ImU32 colour, float scale) {
  list->AddLine(from, to, kShadow, 2.6f * scale);
  list->AddLine(from, to, colour, 1.2f * scale);
}

/// Slanted strokes through the cells, a few pixels apart whatever the cells' size; `at`: from pixels of the
/// frame to the screen. Fainter beyond the pad, where nothing is missed.
template <typename At>
void draw_unknown(ImDrawList* list, const At& at, const UnknownCells& map, float scale) {
  if (map.reasons.empty()) return;
  constexpr float kApart_px = 5;
  const ImVec2 first = at(-0.5, -0.5), next = at(map.cell_px - 0.5, -0.5);
  const float cell_px = std::hypot(next.x - first.x, next.y - first.y);
  const auto stride =
      std::max(1u, static_cast<uint32_t>(std::lround(kApart_px * scale / std::max(cell_px, 0.1f))));
  const auto reasons_at = [&map](uint32_t x, uint32_t y) { return map.reasons[size_t{y} * map.width + x]; };
  for (uint32_t sum = 0; sum < map.width + map.height - 1; sum += stride) {
    uint32_t x = sum < map.height ? 0 : sum - map.height + 1;
    const uint32_t end = std::min(sum + 1, map.width);
    while (x < end) {
      const uint32_t begin = x;
      const uint8_t reasons = reasons_at(x, sum - x);
      while (x < end && reasons_at(x, sum - x) == reasons) ++x;
      if (reasons == 0) continue;
      stroke(list, at(begin * map.cell_px - 0.5, (sum - begin + 1) * map.cell_px - 0.5),
             at(x * map.cell_px - 0.5, (sum - x + 1) * map.cell_px - 0.5),
             reasons == UnknownCells::Outside ? kLost : kWarning, scale);
    }
  }
}

constexpr ImU32 kTrail = IM_COL32(120, 230, 170, 255);
constexpr ImU32 kAxes[3] = {IM_COL32(255, 96, 88, 255), IM_COL32(110, 220, 90, 255),
                            IM_COL32(96, 150, 255, 255)};

/// The way that the object has gone, and its axes, x red, y green, z blue, where its turns are known; at
/// first z points into the picture and is a dot. `reach_px` of the frame: an axis in the picture's plane.
template <typename At>
void draw_trail(ImDrawList* list, const At& at, const Trail& trail, const FrameFormat& format,
                double pitch_mm_per_px, float scale) {
  if (trail.places_mm().empty() || !(pitch_mm_per_px > 0)) return;
  const auto pixel = [&](const std::array<double, 2>& mm) {
    return at(mm[0] / pitch_mm_per_px + 0.5 * (format.width - 1),
              mm[1] / pitch_mm_per_px + 0.5 * (format.height - 1));
  };
  std::vector<ImVec2> way;
  way.reserve(trail.places_mm().size());
  for (const std::array<double, 2>& place : trail.places_mm()) way.push_back(pixel(place));
  const auto count = static_cast<int>(way.size());
  list->AddPolyline(way.data(), count, kShadow, 0, 3.2f * scale);
  list->AddPolyline(way.data(), count, kTrail, 0, 1.5f * scale);
  const std::array<double, 2> now = trail.places_mm().back();
  const double reach_mm = 0.12 * std::min(format.width, format.height) * pitch_mm_per_px;
  for (size_t axis = 0; trail.turns_known() && axis < 3; ++axis) {
    const ImVec2 tip =
        pixel({now[0] + reach_mm * trail.axes()[axis][0], now[1] + reach_mm * trail.axes()[axis][1]});
    draw_arrow(list, way.back(), {tip.x - way.back().x, tip.y - way.back().y}, kAxes[axis], 2 * scale, scale);
  }
  list->AddCircleFilled(way.back(), 3.6f * scale, kShadow);
  list->AddCircleFilled(way.back(), 2.6f * scale, kTrail);
}

/// The largest depth, with its error or why it is none.
std::string deepest_words(const Touch& touch) {
  if (!touch.surface) return {};
  const SurfaceSummary& s = *touch.surface;
  if (s.validity != Validity::Valid) return text("%.3g mm deep (%s)", s.depth_max_mm, to_string(s.validity));
  return s.depth_sd_mm > 0 ? text("%.3f \xc2\xb1 %.3f mm deep", s.depth_max_mm, s.depth_sd_mm)
                           : text("%.3f mm deep", s.depth_max_mm);
}

}  // namespace

void draw_touch(ImDrawList* list, const ViewRect& rect, const Touch& touch, const FrameFormat& format,
                const ImageMarks& marks) {
  const float scale = marks.scale;
  const ImVec2 low = corner(rect), high = far_corner(rect);
  const Place place{low, static_cast<double>(rect.width) / format.width};
  list->PushClipRect(low, high, true);
  const auto at = [&place](double x_px, double y_px) { return place.at(x_px, y_px); };
  if (marks.unknown) draw_unknown(list, at, *marks.unknown, scale);
  if (marks.skin && touch.skin) draw_skin(list, place, touch, scale);
  if (marks.contacts && touch.regions) {
    for (const ContactTouch& c : touch.contacts) {
      const ImVec2 centre = place.at(c.centroid_x_px, c.centroid_y_px);
      draw_ellipse(list, at, c.centroid_x_px, c.centroid_y_px, c.ellipse, c.at_border, scale);
      draw_cross(list, centre, scale);
      draw_shear(list, rect, centre, c.shear_x_N, c.shear_y_N, marks);
    }
    for (const ContactTouch& c : touch.contacts) {  // on top of all outlines
      const ImVec2 centre = place.at(c.centroid_x_px, c.centroid_y_px);
      const bool saturated = saturation_matters(c, touch);
      shadowed_text(list, {centre.x + 7 * scale, centre.y - ImGui::GetFontSize() - 4 * scale},
                    saturated ? kWarning : kMarker, text(saturated ? "%u sat." : "%u", c.id));
    }
  } else if (marks.contacts && touch.contact && std::isfinite(touch.centroid_x_px)) {
    const ImVec2 centre = place.at(touch.centroid_x_px, touch.centroid_y_px);
    draw_ellipse(list, at, touch.centroid_x_px, touch.centroid_y_px, touch.ellipse, touch.at_border, scale);
    draw_cross(list, centre, scale);
    draw_shear(list, rect, centre, touch.shear_x_N, touch.shear_y_N, marks);
  }
  if (marks.trail) draw_trail(list, at, *marks.trail, format, marks.pitch_mm_per_px, scale);
  std::string warnings;
  if (touch.at_border) warnings += "AT BORDER";
  if (saturation_matters(touch))
    warnings += text("%sSATURATED %llu px", warnings.empty() ? "" : "  ",
                     static_cast<unsigned long long>(touch.saturated_px));
  if (touch.surface && touch.surface->validity == Validity::Extrapolated)
    warnings += std::string(warnings.empty() ? "" : "  ") + "EXTRAPOLATED";
  if (touch.regions && touch.regions->overflow)
    warnings += std::string(warnings.empty() ? "" : "  ") + "TOO MANY REGIONS";
  const float line = ImGui::GetFontSize() + 4 * scale;
  if (marks.unknown && marks.unknown->all && marks.explains_unknown)
    shadowed_text(list, {low.x + 5 * scale, high.y - (warnings.empty() ? 1 : 2) * line}, kWarning,
                  shortened("hatched: " + words_of(*marks.unknown), size_of(rect).x - 10 * scale));
  if (!warnings.empty()) {
    list->AddRect({low.x + scale, low.y + scale}, {high.x - scale, high.y - scale}, kWarning, 0, 0,
                  2 * scale);
    shadowed_text(list, {low.x + 5 * scale, high.y - line}, kWarning, warnings);
  }
  list->PopClipRect();
}

void draw_touch(ImDrawList* list, const SurfacePlace& on, const Touch& touch, const FrameFormat& format,
                const ImageMarks& marks, std::vector<PlacedText> placed) {
  const auto at = [&](double x_px, double y_px) {
    const Projected p = on.eye.project({(2 * (x_px + 0.5) / format.width - 1) * on.half_mm.x,
                                        (1 - 2 * (y_px + 0.5) / format.height) * on.half_mm.y, 0});
    return ImVec2{static_cast<float>(on.view.x + p.x * on.view.width),
                  static_cast<float>(on.view.y + p.y * on.view.height)};
  };
  for (const double x : {-on.half_mm.x, on.half_mm.x})
    for (const double y : {-on.half_mm.y, on.half_mm.y})
      if (!on.eye.project({x, y, 0}).in_front) return;
  list->PushClipRect(corner(on.view), far_corner(on.view), true);
  if (marks.unknown) draw_unknown(list, at, *marks.unknown, marks.scale);
  const auto beside = [&](double x_px, double y_px, const Ellipse& ellipse, const std::string& words) {
    const ImVec2 right = at(x_px + 0.55 * ellipse.major_px, y_px), size = ImGui::CalcTextSize(words.c_str());
    const PlacedText label{words, right.x, right.y - size.y / 2, right.x + size.x, right.y + size.y / 2};
    const float apart = 3 * marks.scale,
                end = far_corner(on.view).x - static_cast<float>(kColourBarRoom_px) * marks.scale;
    const bool taken = std::ranges::any_of(placed, [&](const PlacedText& other) {
      return label.left < other.right + apart && other.left < label.right + apart &&
             label.top < other.bottom + apart && other.top < label.bottom + apart;
    });
    if (words.empty() || taken || label.right > end) return;
    shadowed_text(list, {label.left, label.top}, kMarker, words);
    placed.push_back(label);
  };
  // A contact ends with the pad, however far its ellipse reaches.
  const auto on_pad = [&](double x_px, double y_px) {
    return at(std::clamp(x_px, -0.5, format.width - 0.5), std::clamp(y_px, -0.5, format.height - 0.5));
  };
  if (touch.regions) {
    const bool one = touch.contacts.size() == 1;
    for (const ContactTouch& c : touch.contacts)
      draw_ellipse(list, on_pad, c.centroid_x_px, c.centroid_y_px, c.ellipse, c.at_border, marks.scale);
    for (const ContactTouch& c : touch.contacts)
      beside(c.centroid_x_px, c.centroid_y_px, c.ellipse, one ? deepest_words(touch) : text("%u", c.id));
  } else if (touch.contact && std::isfinite(touch.centroid_x_px)) {
    draw_ellipse(list, on_pad, touch.centroid_x_px, touch.centroid_y_px, touch.ellipse, touch.at_border,
                 marks.scale);
    beside(touch.centroid_x_px, touch.centroid_y_px, touch.ellipse, deepest_words(touch));
  }
  if (marks.trail) draw_trail(list, at, *marks.trail, format, marks.pitch_mm_per_px, marks.scale);
  list->PopClipRect();
}

void draw_unknown_key(ImDrawList* list, std::array<float, 2> at, const UnknownCells& cells, float room_px,
                      float scale) {
  const float side = ImGui::GetFontSize(), apart = 5 * scale;
  for (float x = 0; x + side <= 2 * side; x += apart)
    stroke(list, {at[0] + x, at[1] + side}, {at[0] + x + side, at[1]},
           cells.all == UnknownCells::Outside ? kLost : kWarning, scale);
  const float left = 2 * side + 6 * scale;
  list->AddText({at[0] + left, at[1]}, ink(theme().faint),
                shortened(words_of(cells), room_px - left).c_str());
}

void draw_lump(ImDrawList* list, const ViewRect& rect, const PressAnswer& answer, const Sensor& sensor,
               const FrameFormat& format, float scale) {
  if (!answer.estimate || !has_scale(sensor)) return;
  const lump::Estimate& e = *answer.estimate;
  if (!reports_numbers(e.verdict)) return;
  const Place place{corner(rect), static_cast<double>(rect.width) / format.width};
  const auto at = [&](double x_mm, double y_mm) {
    return place.at((x_mm - answer.window_mm[0]) / sensor.pitch_mm_per_px + (format.width - 1) / 2.0,
                    (y_mm - answer.window_mm[1]) / sensor.pitch_mm_per_px + (format.height - 1) / 2.0);
  };
  list->PushClipRect(corner(rect), far_corner(rect), true);
  const ImVec2 centre = at(e.x_mm.value, e.y_mm.value);
  const auto radius = static_cast<float>(0.5 * e.size_mm.value * place.zoom / sensor.pitch_mm_per_px);
  for (const auto& [colour, width] : {std::pair{kShadow, 3.6f * scale}, std::pair{kLump, 1.8f * scale}}) {
    list->AddCircle(centre, radius, colour, 48, width);
    list->AddLine(at(e.x_mm.low, e.y_mm.value), at(e.x_mm.high, e.y_mm.value), colour, width);
    list->AddLine(at(e.x_mm.value, e.y_mm.low), at(e.x_mm.value, e.y_mm.high), colour, width);
  }
  const std::string words = text("lump %.1f mm", e.size_mm.value);
  const ImVec2 size = ImGui::CalcTextSize(words.c_str());
  // Below the circle, or above it where the image ends.
  const float below = centre.y + radius + 3 * scale;
  const float y = below + size.y < far_corner(rect).y ? below : centre.y - radius - size.y - 3 * scale;
  shadowed_text(list, {centre.x - size.x / 2, y}, kLump, words);
  list->PopClipRect();
}

void draw_strain_bar(ImDrawList* list, const ViewRect& rect, const StrainTexels& strain,
                     const ViewState& state, float scale) {
  const float right = far_corner(rect).x - 6 * scale;
  const float top = corner(rect).y + 3 * scale;
  const auto right_text = [&](float y, const std::string& words) {
    shadowed_text(list, {right - ImGui::CalcTextSize(words.c_str()).x, y}, IM_COL32(235, 238, 242, 255),
                  words);
  };
  const std::string name = text("skin %s", to_string(state.skin_strain));
  if (!strain.texels) {
    right_text(top, name + ": " + strain.missing);
    return;
  }
  right_text(top, std::isfinite(strain.sd) ? name + text(" \xc2\xb1 %.2g %%", 100 * strain.sd) : name);
  const float line = ImGui::GetFontSize() + 2 * scale, width = std::min(120 * scale, 0.4f * size_of(rect).x);
  const float y = top + line, height = 8 * scale;
  constexpr int kBands = 32;
  for (int i = 0; i < kBands; ++i) {
    const auto [red, green, blue] = colour_of(state.map, (i + 0.5) / kBands);
    const float x = right - width + width * static_cast<float>(i) / kBands;
    list->AddRectFilled({x, y}, {x + width / kBands + 1, y + height},
                        ImGui::ColorConvertFloat4ToU32({red, green, blue, 1}));
  }
  list->AddRect({right - width, y}, {right, y + height}, kShadow);
  right_text(y + height + scale, text("%g %%", 100 * state.skin_strain_range));
  shadowed_text(list, {right - width, y + height + scale}, IM_COL32(235, 238, 242, 255), "0");
}

}  // namespace palpate::viz
