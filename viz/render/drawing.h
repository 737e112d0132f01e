// What panels and marks draw with ImGui alike: rectangles of the picture, colours of charts, words in a
// colour.
#pragma once

#include <imgui.h>

#include <string>

#include "viz/render/surface_view.h"

namespace palpate::viz {

inline constexpr ImU32 kPaper = IM_COL32(26, 30, 36, 255);
inline constexpr ImU32 kGridLine = IM_COL32(58, 64, 74, 255);
inline constexpr ImU32 kFrameLine = IM_COL32(84, 92, 104, 255);
inline constexpr ImU32 kText = IM_COL32(205, 211, 220, 255);
inline constexpr ImU32 kFaint = IM_COL32(150, 158, 170, 255);
inline constexpr ImU32 kDepthLine = IM_COL32(0, 190, 140, 255);
inline constexpr ImU32 kLimit = IM_COL32(240, 228, 66, 200);

/// Of pages of forms: what is chosen or well, and what went wrong.
inline const ImVec4 kPageBlue{0.34f, 0.71f, 0.91f, 1}, kPageRed{1, 0.47f, 0.24f, 1};

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

inline void wrapped_text(const std::string& words, const ImVec4& tint) {
  ImGui::PushStyleColor(ImGuiCol_Text, tint);
  ImGui::TextWrapped("%s", words.c_str());
  ImGui::PopStyleColor();
}

}  // namespace palpate::viz
