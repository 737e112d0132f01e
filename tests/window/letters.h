// The letters that ImGui has drawn in a picture, and the words that they make.
#pragma once

#include <imgui.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/base/text.h"

namespace palpate::viz {

/// A letter as it is drawn, px, and the part of the picture that it may be drawn in.
struct Letter {
  ImVec2 low, high;
  ImVec4 clip;
  ImVec2 uv;  ///< of its first corner, by which a font knows it
};

/// All letters of a picture: rectangles whose texels are not the one white texel of lines and areas.
inline std::vector<Letter> letters_of(const ImDrawData& data) {
  const ImVec2 white = ImGui::GetIO().Fonts->TexUvWhitePixel;
  std::vector<Letter> letters;
  for (int n = 0; n < data.CmdListsCount; ++n) {
    const ImDrawList& list = *data.CmdLists[n];
    for (const ImDrawCmd& cmd : list.CmdBuffer)
      for (unsigned i = 0; i + 5 < cmd.ElemCount;) {
        const auto vertex = [&](unsigned at) -> const ImDrawVert& {
          return list.VtxBuffer[static_cast<int>(cmd.VtxOffset +
                                                 list.IdxBuffer[static_cast<int>(cmd.IdxOffset + at)])];
        };
        // Two triangles 0 1 2, 0 2 3 make one letter.
        const ImDrawVert &a = vertex(i), &c = vertex(i + 2);
        const bool quad = &vertex(i + 3) == &a && &vertex(i + 4) == &c;
        const bool anti_aliased_line = a.uv.x == c.uv.x || a.uv.y == c.uv.y;
        if (quad && (a.uv.x != white.x || a.uv.y != white.y) && !anti_aliased_line) {
          letters.push_back({a.pos, c.pos, cmd.ClipRect, a.uv});
          i += 6;
        } else {
          i += 3;
        }
      }
  }
  return letters;
}

/// What is wrong with them; empty: nothing. Letters are a little larger than what of them is seen.
inline std::string fault_of(const std::vector<Letter>& letters, float scale) {
  const float slack = 2 * scale;
  for (const Letter& l : letters)
    if (l.low.x < l.clip.x - slack || l.high.x > l.clip.z + slack || l.low.y < l.clip.y - slack ||
        l.high.y > l.clip.w + slack)
      return text("cut at %g, %g", static_cast<double>(l.low.x), static_cast<double>(l.low.y));
  for (size_t i = 0; i < letters.size(); ++i)
    for (size_t j = 0; j < i; ++j) {
      const Letter &a = letters[i], &b = letters[j];
      if (a.low.x + slack < b.high.x && b.low.x + slack < a.high.x && a.low.y + slack < b.high.y &&
          b.low.y + slack < a.high.y)
        return text("one over another at %g, %g", static_cast<double>(a.low.x), static_cast<double>(a.low.y));
    }
  return {};
}

/// They one after the other as they were drawn, without blanks, which are not drawn; signs that are not of
/// ASCII are left out.
inline std::string words_of(const std::vector<Letter>& letters) {
  std::string words;
  for (const Letter& letter : letters) {
    char sign = 0;
    for (const ImFont* font : ImGui::GetIO().Fonts->Fonts)
      for (const ImFontGlyph& glyph : font->Glyphs)
        if (glyph.U0 == letter.uv.x && glyph.V0 == letter.uv.y && glyph.Codepoint < 0x80)
          sign = static_cast<char>(glyph.Codepoint);
    if (sign != 0) words += sign;
  }
  return words;
}
/// Size of the smallest font that is used, px.
inline float smallest_of(const std::vector<Letter>& letters) {
  float smallest = 1000;
  for (const Letter& letter : letters)
    for (const ImFont* font : ImGui::GetIO().Fonts->Fonts)
      for (const ImFontGlyph& glyph : font->Glyphs)
        if (glyph.U0 == letter.uv.x && glyph.V0 == letter.uv.y) smallest = std::min(smallest, font->FontSize);
  return smallest;
}
/// Whether these words are among them.
inline bool says(const std::string& drawn, std::string words) {
  std::erase(words, ' ');
  return drawn.find(words) != std::string::npos;
}

}  // namespace palpate::viz
