// What panels and marks draw with ImGui alike: rectangles of the picture, colours, words in a colour.
#pragma once

#include <imgui.h>

#include <string>

#include "viz/look/theme.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// A colour as lists of lines and words take it, and as styles do.
inline ImU32 ink(Rgb c, int alpha = 255) {
  return IM_COL32(c.red, c.green, c.blue, alpha);
}
inline ImVec4 tint(Rgb c, float alpha = 1) {
  return {static_cast<float>(c.red) / 255, static_cast<float>(c.green) / 255,
          static_cast<float>(c.blue) / 255, alpha};
}

inline ImVec2 size_of(const ViewRect& r) {
  return {static_cast<float>(r.width), static_cast<float>(r.height)};
}
/// At the top left.
inline ImVec2 corner(const ViewRect& r) {
  return {static_cast<float>(r.x), static_cast<float>(r.y)};
}
/// At the bottom right.
inline ImVec2 far_corner(const ViewRect& r) {
  return {corner(r).x + size_of(r).x, corner(r).y + size_of(r).y};
}
inline ImVec2 middle(const ViewRect& r) {
  return {corner(r).x + size_of(r).x / 2, corner(r).y + size_of(r).y / 2};
}
inline bool inside(const ViewRect& r, ImVec2 p) {
  return p.x >= corner(r).x && p.y >= corner(r).y && p.x < far_corner(r).x && p.y < far_corner(r).y;
}

/// Words on a dark ground of their own, over a picture.
inline void shadowed_text(ImDrawList* list, ImVec2 at, ImU32 colour, const std::string& words) {
  const ImVec2 size = ImGui::CalcTextSize(words.c_str());
  list->AddRectFilled({at.x - 2, at.y}, {at.x + size.x + 2, at.y + size.y}, IM_COL32(0, 0, 0, 165), 3);
  list->AddText(at, colour, words.c_str());
}

inline void wrapped_text(const std::string& words, const ImVec4& colour) {
  ImGui::PushStyleColor(ImGuiCol_Text, colour);
  ImGui::TextWrapped("%s", words.c_str());
  ImGui::PopStyleColor();
}

}  // namespace palpate::viz
