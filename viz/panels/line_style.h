// Lines of charts: whole, dashed and dotted, told apart without colour.
#pragma once

#include <imgui.h>

namespace palpate::viz {

enum class Stroke { Solid, Dashed, Dotted };

/// A line that is drawn piece by piece; its pattern goes on from one piece to the next, however long each is.
class StrokeLine {
 public:
  /// `scale`: of lengths and of the line's width.
  StrokeLine(ImDrawList* list, ImU32 colour, Stroke stroke, float scale)
      : list_(list), colour_(colour), stroke_(stroke), scale_(scale) {}
  void piece(ImVec2 from, ImVec2 to);

 private:
  ImDrawList* list_;
  ImU32 colour_;
  Stroke stroke_;
  float scale_;
  float travelled_ = 0;  ///< since the pattern began
};

}  // namespace palpate::viz
