// The axis of time that all strip charts share: the part of it that is shown, and the mouse on it.
#pragma once

#include <optional>
#include <utility>

#include "viz/live/history.h"
#include "viz/render/layout.h"
#include "viz/render/view_state.h"

namespace palpate::viz {

/// Appearance of the charts.
struct ChartStyle {
  double span_s = 10;                 ///< of the time axis where it does not show a whole recording
  bool whole = true;                  ///< recordings in which the person can jump are shown from end to end
  float scale = 1;                    ///< of text
  std::optional<TimeSpan> view = {};  ///< that the person chose
  std::optional<double> cursor = {};  ///< time that is read: under the mouse, or by keys
};

TimeSpan shown_span(const History& history, const ChartStyle& style);

/// From the left to the right end of the axis of time in charts at `rect`, px.
std::pair<float, float> axis_ends(const ViewRect& rect, float scale);

/// The time on the axis under a place `x` (px) of the picture; none outside the charts.
std::optional<double> time_under(float x, const ViewRect& rect, const History& history,
                                 const ChartStyle& style);

/// Does what keys asked of the charts. The cursor starts at the newest value; zooming goes about it.
void follow_chart_keys(const History& history, const ChartStyle& style, ViewState& state);

/// The wheel zooms time, a drag pans it, a double click shows all of it, a click in a recording goes there, a
/// right click opens the menu.
class ChartMouse {
 public:
  /// Once a picture, between ImGui's begin and end. True while the mouse is theirs, and turns nothing else.
  bool follow(const ViewRect& charts, const History& history, const ChartStyle& style, ViewState& state);

 private:
  std::optional<TimeSpan> held_;  ///< the part that was shown when a button went down
  bool moved_ = false;            ///< since then: a drag, not a click
};

}  // namespace palpate::viz
