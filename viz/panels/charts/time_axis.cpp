#include "viz/panels/charts/time_axis.h"

#include <imgui.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "viz/render/drawing.h"

namespace palpate::viz {
namespace {

/// All that could be shown, from the first to the last moment.
TimeSpan all_of(const History& history) {
  const Timeline& timeline = history.timeline();
  if (timeline.whole()) {
    const double length = std::max(timeline.length(), 1e-3);
    return {timeline.start() + length, length};
  }
  if (history.samples().empty()) return {};
  const double last = history.samples().back().time;
  return {last, std::max(last - history.samples().front().time, 1e-3)};
}

/// The shortest part that says something: a few frames.
double least_length(const History& history) {
  const Timeline& timeline = history.timeline();
  if (!timeline.timed) return 5;
  return timeline.rate_Hz > 0 ? 5 / timeline.rate_Hz : 0.2;
}

/// Shows `wanted`, or, where that is all there is or reaches the present of a live session, lets the axis
/// follow again.
void choose(TimeSpan wanted, const History& history, ViewState& state) {
  const TimeSpan all = all_of(history);
  const bool whole = history.timeline().whole();
  if (whole && wanted.length >= all.length) {
    state.chart_view.reset();
    state.whole_recording = true;
    return;
  }
  wanted.end = std::clamp(wanted.end, std::min(all.end - all.length + wanted.length, all.end), all.end);
  if (!whole && wanted.end >= all.end)
    state.chart_view.reset();
  else
    state.chart_view = wanted;
}

void zoom(double factor, double about, const History& history, const ChartStyle& style, ViewState& state) {
  if (!history.timeline().whole() && !style.view) {  // it goes on following the present
    const double unit = history.timeline().timed ? 1 : 10;
    state.chart_span_s =
        std::clamp(style.span_s * factor, std::max(1.0, least_length(history) / unit), History::kLongest_s);
    return;
  }
  const TimeSpan now = shown_span(history, style);
  const double length = std::clamp(now.length * factor, least_length(history),
                                   std::max(all_of(history).length, least_length(history)));
  choose({about + (now.end - about) * length / now.length, length}, history, state);
}

}  // namespace

TimeSpan shown_span(const History& history, const ChartStyle& style) {
  if (style.view) return *style.view;
  const Timeline& timeline = history.timeline();
  const double span = style.span_s * (timeline.timed ? 1 : 10);
  if (!timeline.whole()) {
    const double last = history.samples().empty() ? 0 : history.samples().back().time;
    return {std::max(last, span), span};
  }
  if (style.whole || span >= timeline.length()) return all_of(history);
  // Page by page, so that the axis stands still while the cursor moves.
  const double page = std::max(0.0, std::floor((history.now() - timeline.start()) / span));
  return {timeline.start() + (page + 1) * span, span};
}

std::pair<float, float> axis_ends(const ViewRect& rect, float scale) {
  return {corner(rect).x + static_cast<float>(kAxisLeft_px) * scale,
          far_corner(rect).x - static_cast<float>(kAxisRight_px) * scale};
}

std::optional<double> time_under(float x, const ViewRect& rect, const History& history,
                                 const ChartStyle& style) {
  const auto [left, right] = axis_ends(rect, style.scale);
  if (x < left || x > right) return std::nullopt;
  const TimeSpan span = shown_span(history, style);
  return span.end - span.length * static_cast<double>((right - x) / (right - left));
}

void follow_chart_keys(const History& history, const ChartStyle& style, ViewState& state) {
  const ChartMoves moves = std::exchange(state.chart_moves, {});
  const TimeSpan now = shown_span(history, style);
  const double begin = now.end - now.length;
  if (moves.cursor != 0) {
    const double newest = history.samples().empty() ? now.end : history.samples().back().time;
    state.chart_cursor =
        std::clamp(state.chart_cursor.value_or(newest) + moves.cursor * now.length, begin, now.end);
  }
  if (moves.zoom != 1) {
    const double about = state.chart_cursor.value_or(now.end);
    zoom(moves.zoom, about >= begin && about <= now.end ? about : now.end, history, style, state);
  }
  if (moves.pan != 0) choose({now.end + moves.pan * now.length, now.length}, history, state);
}

bool ChartMouse::follow(const ViewRect& charts, const History& history, const ChartStyle& style,
                        ViewState& state) {
  constexpr float kClick_px = 4;  // a hand moves while it clicks
  const ImGuiIO& io = ImGui::GetIO();
  const bool over = !io.WantCaptureMouse && inside(charts, io.MousePos);
  const std::optional<double> time = time_under(io.MousePos.x, charts, history, style);
  if (over && (io.MouseDelta.x != 0 || io.MouseDelta.y != 0)) state.chart_cursor.reset();
  if (over && ImGui::IsMouseReleased(ImGuiMouseButton_Right) &&
      inside(charts, io.MouseClickedPos[ImGuiMouseButton_Right]))
    state.chart_menu = std::array{io.MousePos.x, io.MousePos.y};
  if (over && time && io.MouseWheel != 0)
    zoom(std::pow(0.8, static_cast<double>(io.MouseWheel)), *time, history, style, state);
  if (over && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
    state.chart_view.reset();
    state.whole_recording = true;
  } else if (over && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    held_ = shown_span(history, style);
    moved_ = false;
  }
  const bool taken = over || held_;
  if (held_) {
    const auto [left, right] = axis_ends(charts, style.scale);
    const float moved_px = io.MousePos.x - io.MouseClickedPos[ImGuiMouseButton_Left].x;
    moved_ = moved_ || std::abs(moved_px) > kClick_px * style.scale;
    if (moved_)
      choose({held_->end - held_->length * static_cast<double>(moved_px / (right - left)), held_->length},
             history, state);
    if (!io.MouseDown[ImGuiMouseButton_Left]) {
      if (!moved_ && time && history.timeline().whole()) state.seek_to = history.timeline().frame_at(*time);
      held_.reset();
    }
  }
  return taken;
}

}  // namespace palpate::viz
