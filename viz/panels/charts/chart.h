// One chart of a strip: a frame with a y axis and the shared axis of time, drawn with ImGui.
#pragma once

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "viz/live/history.h"
#include "viz/panels/charts/line_style.h"
#include "viz/render/drawing.h"

namespace palpate::viz {

/// Distance of the ticks of an axis from `least` (0 or below) to `most` (above it): room for `ticks` of them,
/// but never so far apart that zero stands alone.
double tick_step(double least, double most, int ticks);

/// Two standard errors to either side of what is known.
std::optional<std::pair<double, double>> interval(const Estimate& estimate);

/// What an axis of values has to show.
struct AxisRange {
  double least = 0, most = 0;
  void take(double value);
  void take(const std::optional<std::pair<double, double>>& both) {
    if (both) take(both->first), take(both->second);
  }
  /// Rounded outwards at the top, at least `smallest` long; returns the distance of ticks for `ticks` of
  /// them.
  double round(double smallest, int ticks);
};

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

  /// One line, where there is a value; samples have `time` and `gap`. A sample between two gaps is a dot.
  template <typename S, typename Value>
  void line(const std::deque<S>& samples, const Value& value, ImU32 colour, LineStyle line_style) const {
    StyledLine drawn(list_, colour, line_style, scale_);
    ImVec2 last{};
    bool joined = false, alone = false;
    const auto end_piece = [&] {
      if (alone) list_->AddCircleFilled(last, 1.5f * scale_, colour);
      joined = alone = false;
    };
    for (const S& s : samples) {
      const std::optional<double> v = visible(s.time) ? value(s) : std::nullopt;
      if (!v || !std::isfinite(*v)) {
        end_piece();
        continue;
      }
      const ImVec2 p = at(s.time, *v);
      if (s.gap) end_piece();
      if (joined && p.x - last.x < 1 && std::abs(p.y - last.y) < 1) continue;
      if (joined) drawn.piece(last, p);
      alone = !joined;
      last = p;
      joined = true;
    }
    end_piece();
  }
  using Ends = std::pair<double, double>;
  template <typename S, typename Between>
  void band(const std::deque<S>& samples, const Between& ends, ImU32 colour) const {
    ImVec2 low{}, high{};
    bool joined = false;
    for (const S& s : samples) {
      const std::optional<Ends> both = visible(s.time) ? ends(s) : std::nullopt;
      if (!both) {
        joined = false;
        continue;
      }
      const ImVec2 a = at(s.time, both->first), b = at(s.time, both->second);
      if (s.gap) joined = false;
      if (joined && a.x - low.x < 1) continue;
      if (joined) list_->AddQuadFilled(high, b, a, low, colour);
      low = a;
      high = b;
      joined = true;
    }
  }
  /// Ticks and numbers of the axis of time, of which this chart is the room, with its title at the right end.
  /// What would stand between `covered` px has no room.
  void time_ticks(const char* title, Ends covered = {0, 0}) const;
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
