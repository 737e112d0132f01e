#include "viz/panels/charts/line_style.h"

#include <algorithm>
#include <cmath>

namespace palpate::viz {

void StyledLine::piece(ImVec2 from, ImVec2 to) {
  const float width = (line_style_ == LineStyle::Dotted ? 1.2f : 1.7f) * scale_;
  const float length = std::hypot(to.x - from.x, to.y - from.y);
  if (line_style_ == LineStyle::Solid) {
    list_->AddLine(from, to, colour_, width);
    return;
  }
  const float period = (line_style_ == LineStyle::Dashed ? 11 : 6) * scale_;
  const float on = (line_style_ == LineStyle::Dashed ? 7 : 2) * scale_;
  const auto at = [&](float along) {
    return ImVec2{from.x + (to.x - from.x) * along / length, from.y + (to.y - from.y) * along / length};
  };
  for (float along = 0; along < length;) {
    const float phase = std::fmod(travelled_ + along, period);
    const bool drawn = phase < on;
    // A least step, so that rounding never holds it in place.
    const float end = std::min(length, along + std::max((drawn ? on : period) - phase, 0.01f * scale_));
    if (drawn) list_->AddLine(at(along), at(end), colour_, width);
    along = end;
  }
  travelled_ = std::fmod(travelled_ + length, period);
}

}  // namespace palpate::viz
