// Line styles of charts: solid, dashed and dotted, distinguishable without colour.
#pragma once

#include <imgui.h>

namespace palpate::viz {

enum class LineStyle { Solid, Dashed, Dotted };

/// A line that is drawn piece by piece; its pattern goes on from one piece to the next, however long each is.
class StyledLine {
 public:
  /// `scale`: of lengths and of the line's width.
  StyledLine(ImDrawList* list, ImU32 colour, LineStyle line_style, float scale)
      : list_(list), colour_(colour), line_style_(line_style), scale_(scale) {}
  void piece(ImVec2 from, ImVec2 to);

 private:
  ImDrawList* list_;
  ImU32 colour_;
  LineStyle line_style_;
  float scale_;
  float travelled_ = 0;  ///< since the pattern began
};

}  // namespace palpate::viz
