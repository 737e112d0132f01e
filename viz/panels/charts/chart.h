// One chart of a strip: a frame with a y axis and the shared axis of time, drawn with ImGui.
#pragma once

#include <imgui.h>

#include <algorithm>
#include <deque>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "viz/live/history.h"
#include "viz/panels/charts/line_style.h"
#include "viz/render/drawing.h"

namespace palpate::viz {

/// One chart: a frame with a y axis, the shared time axis, and a row of words above the frame, so that none
/// lies over a curve.
class Chart {
 public:
  Chart(ImDrawList* list, ImVec2 low, ImVec2 high, double end_s, double span_s, float scale)
      : list_(list), low_(low), high_(high), end_s_(end_s), span_s_(span_s), scale_(scale) {}

  void set_range(double least, double most) {
    least_ = least;
    most_ = most > least ? most : least + 1;
  }
  ImVec2 at(double time_s, double value) const {
    const double x = 1 - (end_s_ - time_s) / span_s_;
    const double y = (value - least_) / (most_ - least_);
    return {low_.x + static_cast<float>(x) * (high_.x - low_.x),
            high_.y - static_cast<float>(std::clamp(y, -0.1, 1.1)) * (high_.y - low_.y)};
  }
  bool visible(double time_s) const {
    return time_s >= end_s_ - 1.02 * span_s_ && time_s <= end_s_ + 0.02 * span_s_;
  }

  /// Paper and grid of this range; lines stay within the frame until unclip().
  void begin(double least, double most, double step) {
    set_range(least, most);
    paper(step);
    clip();
  }
  /// The next words of the row above, from its left end; shortened where there is no room for all.
  void title(const std::string& whole, ImU32 colour = ink(theme().text));
  /// Words at the right end of that row, once; none where the titles leave no room.
  void note(const std::string& words, ImU32 colour);
  /// A dashed line across the chart.
  void level(double value, ImU32 colour) const;
  void clip() const { list_->PushClipRect(low_, high_, true); }
  void unclip() const { list_->PopClipRect(); }

  /// One line, where there is a value. A sample between two gaps is a dot.
  void line(const std::deque<Sample>& samples,
            const std::function<std::optional<double>(const Sample&)>& value, ImU32 colour,
            LineStyle line_style) const;
  using Ends = std::pair<double, double>;
  void band(const std::deque<Sample>& samples, const std::function<std::optional<Ends>(const Sample&)>& ends,
            ImU32 colour) const;
  void frame() const { list_->AddRect(low_, high_, ink(theme().frame)); }
  ImVec2 low() const { return low_; }
  ImVec2 high() const { return high_; }

 private:
  void paper(double step) const;
  ImDrawList* list_;
  ImVec2 low_, high_;
  double end_s_, span_s_;
  float scale_;
  float titled_ = 0, noted_ = 0;  ///< px of the row above that have words, from its left and its right
  double least_ = 0, most_ = 1;
};

}  // namespace palpate::viz
