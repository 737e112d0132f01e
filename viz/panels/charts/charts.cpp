#include "viz/panels/charts/charts.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <tuple>
#include <utility>
#include <vector>

#include "capture/files/measurements.h"
#include "engine/measure/force.h"
#include "viz/panels/charts/chart.h"
#include "viz/panels/charts/line_style.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

constexpr int kBandAlpha = 70, kWithinAlpha = 34;

struct Ends {
  double least = 0, most = 0;
  void take(double v) {
    if (!std::isfinite(v)) return;
    least = std::min(least, v);
    most = std::max(most, v);
  }
  /// Rounded outwards at the top, at least `smallest` long; returns the distance of ticks for `ticks` of
  /// them.
  double round(double smallest, int ticks) {
    const double length = std::max(most - least, smallest);
    most = scale_ceiling(std::max(1.05 * most, least < 0 ? 0.1 * length : length));
    const double step = tick_step(least, most, ticks);
    // Noise below zero does not cost a whole tick of room.
    least = least < -0.02 * length ? std::max(1.05 * least, std::floor(least / step) * step) : 0;
    return step;
  }
};

/// Two standard errors to either side of what is known.
std::optional<Chart::Ends> interval(const Estimate& e) {
  if (!has_value(e)) return std::nullopt;
  return Chart::Ends{e.value - 2 * e.standard_error, e.value + 2 * e.standard_error};
}

constexpr double kLeastDepthAxis_mm = 0.05;  // as the colours of depth

/// The least that the axis of force shows: at rest noise is no event.
double least_force_axis_N(const ForceCalibration& force) {
  return std::max(0.02, 0.05 * calibrated_range(force).most_N);
}

/// Stick, incipient slip and slip along the time axis: colour, hatching and letters.
void draw_slip_band(ImDrawList* list, ImVec2 low, ImVec2 high, const Chart& time,
                    const std::deque<Sample>& samples, float scale) {
  list->AddRectFilled(low, high, ink(theme().chart));
  list->PushClipRect(low, high, true);
  const auto flush = [&](float from, float to, Slip slip) {
    if (slip == Slip::NoContact || slip == Slip::NotCalibrated || to <= from) return;
    const Rgb colour = theme().of(slip_verdict(slip).meaning);
    const ImU32 full = ink(colour), pale = ink(colour, 110);
    list->AddRectFilled({from, low.y}, {to, high.y}, slip == Slip::Stick ? pale : full);
    const float height = high.y - low.y;
    if (slip == Slip::Incipient) {
      for (float x = std::floor((from - height) / (7 * scale)) * 7 * scale; x < to; x += 7 * scale) {
        list->PushClipRect({from, low.y}, {to, high.y}, true);
        list->AddLine({x, high.y}, {x + height, low.y}, ink(theme().panel), 1.4f * scale);
        list->PopClipRect();
      }
    } else if (slip == Slip::Slip) {
      for (float x = std::ceil(from / (4 * scale)) * 4 * scale; x < to; x += 4 * scale)
        list->AddLine({x, low.y}, {x, high.y}, ink(theme().panel, 160), scale);
    }
    const char* letters = slip == Slip::Stick ? "stick" : slip == Slip::Slip ? "SLIP" : "rim slips";
    const ImVec2 size = ImGui::CalcTextSize(letters);
    if (to - from < size.x + 8 * scale) return;
    const ImVec2 at{(from + to - size.x) / 2, (low.y + high.y - size.y) / 2};
    list->AddRectFilled({at.x - 3, low.y}, {at.x + size.x + 3, high.y}, ink(theme().panel, 215));
    list->AddText(at, full, letters);
  };
  float from = low.x;
  Slip now = Slip::NoContact;
  float last = low.x;
  for (const Sample& s : samples) {
    if (!time.visible(s.time)) continue;
    const float x = std::max(low.x, time.at(s.time, 0).x);
    if (s.slip != now || s.gap) {
      flush(from, s.gap ? last : x, now);
      from = x;
      now = s.slip;
    }
    last = x;
  }
  flush(from, last, now);
  list->PopClipRect();
  list->AddRect(low, high, ink(theme().frame));
}

/// The part of the axis of time that is shown.
struct Span {
  double end = 0, length = 1;  ///< s or frames
};

Span shown_span(const History& history, const ChartStyle& style) {
  const Timeline& timeline = history.timeline();
  const double span = style.span_s * (timeline.timed ? 1 : 10);
  if (!timeline.whole()) {
    const double last = history.samples().empty() ? 0 : history.samples().back().time;
    return {std::max(last, span), span};
  }
  if (style.whole || span >= timeline.length())
    return {timeline.start() + std::max(timeline.length(), 1e-3), std::max(timeline.length(), 1e-3)};
  // Page by page, so that the axis stands still while the cursor moves.
  const double page = std::max(0.0, std::floor((history.now() - timeline.start()) / span));
  return {timeline.start() + (page + 1) * span, span};
}

/// From the left to the right end of the axis of time, px.
std::pair<float, float> axis_ends(const ViewRect& rect, float scale) {
  return {corner(rect).x + 52 * scale, far_corner(rect).x - 10 * scale};
}

/// State common to the charts of one picture.
class StripCharts {
 public:
  StripCharts(ImDrawList* list, const ViewRect& rect, const History& history, const Sensor& sensor,
              const Tare& tare, const ChartStyle& style)
      : list_(list),
        history_(history),
        samples_(history.samples()),
        sensor_(sensor),
        tare_(tare),
        scale_(style.scale),
        low_(corner(rect)),
        high_(far_corner(rect)),
        span_(shown_span(history, style)),
        has_shear_(sensor.shear && sensor.force),
        has_depth_(sensor.reading != SurfaceReading::None) {
    const float row = ImGui::GetFontSize();
    std::tie(left_, right_) = axis_ends(rect, scale_);
    axis_ = row + 5 * scale_;
    band_ = has_shear_ ? row + 6 * scale_ : 0;
    marks_ = history.events().empty() ? 0 : row + 4 * scale_;
    bottom_ = high_.y - axis_ - band_ - marks_;
    const float room = bottom_ - low_.y;
    // Each chart needs room for the words above it and two numbers.
    const int possible = std::max(1, static_cast<int>(room / (3.2f * row)));
    const int wanted = 1 + (has_shear_ ? 1 : 0) + (has_depth_ ? 1 : 0);
    count_ = std::min(possible, wanted);
    head_ = row + 3 * scale_;
    each_ = room / static_cast<float>(count_);
    const float height = each_ - head_ - 2 * scale_;
    ticks_ = std::max(1, static_cast<int>(height / (1.7f * row)));
  }

  void draw() {
    list_->PushClipRect(low_, high_, true);
    if (sensor_.force)
      draw_force();
    else if (!samples_.empty() && samples_.back().layer_N)
      draw_layer_force();
    else  // a hundred pixels at the threshold: below it lies what noise alone makes
      draw_plain([](const Sample& s) { return std::optional(1e-3 * s.gray_sum); },
                 std::max(0.01, 0.1 * sensor_.threshold_gray),
                 "gray sum G [1000 gray levels], force not calibrated", ink(theme().chosen));
    if (has_shear_ && index_ < count_) draw_shear();
    if (has_depth_ && index_ < count_)
      draw_plain([](const Sample& s) { return s.has_depth ? std::optional(s.depth_mm) : std::nullopt; },
                 kLeastDepthAxis_mm, "deepest [mm]", ink(theme().depth));
    draw_time_axis();
    draw_events();
    draw_cursor();
    list_->PopClipRect();
  }

 private:
  Chart next() {
    const float y = low_.y + static_cast<float>(index_++) * each_;
    return Chart(list_, {left_, y + head_}, {right_, y + each_ - 2 * scale_}, span_.end, span_.length,
                 scale_);
  }
  /// A vertical line through all charts, between the words above them.
  template <typename Line>
  void across(Line line) const {
    for (int i = 0; i < index_; ++i) {
      const float y = low_.y + static_cast<float>(i) * each_;
      line(y + head_, y + each_ - 2 * scale_);
    }
  }
  const char* zeroed() const { return tare_.on ? ", tared" : ""; }
  Estimate force(const Sample& s) const { return tare_.on ? tared(s.force_N, tare_.force_N) : s.force_N; }
  Estimate shear(const Sample& s, bool x) const {
    const Estimate& e = x ? s.shear_x_N : s.shear_y_N;
    return tare_.on ? tared(e, x ? tare_.shear_x_N : tare_.shear_y_N) : e;
  }
  /// Where nothing touches, no force is what there was at the zero, with the other sign.
  double untouched(const Estimate& zero) const { return tare_.on && has_value(zero) ? -zero.value : 0.0; }

  void draw_force();
  void draw_layer_force();
  void draw_shear();
  void draw_plain(const std::function<std::optional<double>(const Sample&)>& value, double least_axis,
                  const std::string& title, ImU32 colour);
  void draw_time_axis();
  void draw_events();
  void draw_cursor();

  ImDrawList* list_;
  const History& history_;
  const std::deque<Sample>& samples_;
  const Sensor& sensor_;
  const Tare& tare_;
  float scale_;
  ImVec2 low_, high_;
  Span span_;
  bool has_shear_;  // without a force there is no friction limit, and shear is not drawn
  bool has_depth_;
  float left_ = 0, right_ = 0, axis_ = 0, band_ = 0, marks_ = 0, bottom_ = 0, head_ = 0, each_ = 0;  // px
  int count_ = 0, index_ = 0, ticks_ = 0;
};

/// Where no calibration says the force and the elastic layer does.
void StripCharts::draw_layer_force() {
  constexpr double kLeastAxis_N = 0.05;
  Chart chart = next();
  const auto band = [](const Sample& s) { return s.layer_N ? interval(*s.layer_N) : std::nullopt; };
  Ends ends;
  for (const Sample& s : samples_)
    if (const auto known = band(s); known && chart.visible(s.time)) {
      ends.take(known->first);
      ends.take(known->second);
    }
  const double step = ends.round(kLeastAxis_N, ticks_);
  chart.begin(ends.least, ends.most, step);
  chart.band(samples_, band, ink(theme().chosen, kBandAlpha));
  chart.line(
      samples_,
      [&](const Sample& s) -> std::optional<double> {
        if (band(s)) return s.layer_N->value;
        return s.contact ? std::nullopt : std::optional(0.0);
      },
      ink(theme().chosen), LineStyle::Solid);
  chart.unclip();
  chart.title("force by the layer [N], band: 95 %", ink(theme().chosen));
  chart.frame();
}

void StripCharts::draw_force() {
  Chart chart = next();
  Ends ends;
  const ForceRange range = calibrated_range(*sensor_.force);
  const double zero_N = tare_.on && has_value(tare_.force_N) ? tare_.force_N.value : 0;
  for (const Sample& s : samples_)
    if (chart.visible(s.time) && s.contact) {
      ends.take(force(s).value - 2 * force(s).standard_error);
      ends.take(force(s).value + 2 * force(s).standard_error);
    }
  // The limits, of one contact, come into sight when its force comes near them.
  const bool limits = std::none_of(samples_.begin(), samples_.end(),
                                   [&](const Sample& s) { return chart.visible(s.time) && s.several; });
  if (limits && ends.most > 0.6 * (range.most_N - zero_N)) ends.take(1.02 * (range.most_N - zero_N));
  const double step = ends.round(least_force_axis_N(*sensor_.force), ticks_);
  chart.begin(ends.least, ends.most, step);
  chart.band(
      samples_, [&](const Sample& s) { return interval(force(s)); }, ink(theme().chosen, kBandAlpha));
  chart.line(
      samples_,
      [&](const Sample& s) -> std::optional<double> {
        if (s.force_N.validity == Validity::NotCalibrated) return std::nullopt;
        return has_value(s.force_N) ? force(s).value : untouched(tare_.force_N);
      },
      ink(theme().chosen), LineStyle::Solid);
  const bool lower = range.least_N - zero_N > 0.03 * ends.most;
  if (limits) chart.level(range.most_N - zero_N, ink(theme().limit));
  if (limits && lower) chart.level(range.least_N - zero_N, ink(theme().limit));
  chart.unclip();
  chart.title(text("force [N]%s, band: 95 %%", zeroed()), ink(theme().chosen));
  const std::string from = lower ? text("from %.3g ", range.least_N) : "";
  if (limits)
    chart.note(
        text("calibrated %sto %.3g N (dashed)%s", from.c_str(), range.most_N, tare_.on ? ", untared" : ""),
        ink(theme().limit));
  chart.frame();
}

void StripCharts::draw_shear() {
  Chart chart = next();
  Ends ends;
  for (const Sample& s : samples_)
    if (chart.visible(s.time) && s.contact)
      for (const bool x : {true, false})
        if (has_value(shear(s, x))) ends.take(shear(s, x).value);
  double reach = std::max(-ends.least, ends.most);
  // The friction limit comes into sight when the shear comes near it.
  if (!tare_.on && !samples_.empty() && has_value(samples_.back().force_N))
    if (const double limit_N = sensor_.shear->friction * samples_.back().force_N.value; reach > 0.6 * limit_N)
      reach = std::max(reach, limit_N);
  ends = {0, reach};
  const double step = ends.round(least_shear_axis_N(sensor_, samples_), std::max(1, ticks_ / 2));
  chart.begin(-ends.most, ends.most, step);
  const double friction = sensor_.shear->friction;
  // An area, so that its edges are not taken for events, which are lines across all charts.
  if (!tare_.on)
    chart.band(
        samples_,
        [&](const Sample& s) -> std::optional<Chart::Ends> {
          if (!has_value(s.force_N)) return std::nullopt;
          return Chart::Ends{-friction * s.force_N.value, friction * s.force_N.value};
        },
        ink(theme().limit, kWithinAlpha));
  for (const bool x : {true, false})
    chart.line(
        samples_,
        [&](const Sample& s) -> std::optional<double> {
          const Estimate e = shear(s, x);
          if (e.validity == Validity::NotCalibrated) return std::nullopt;
          return has_value(e) ? e.value : untouched(x ? tare_.shear_x_N : tare_.shear_y_N);
        },
        x ? ink(theme().second) : ink(theme().third), x ? LineStyle::Solid : LineStyle::Dashed);
  chart.unclip();
  chart.title(text("shear [N]%s: x", zeroed()), ink(theme().second));
  chart.title("y (dashed)", ink(theme().third));
  if (!tare_.on) chart.note("area: within the friction limit", ink(theme().limit));
  chart.frame();
}

/// One line, from zero on.
void StripCharts::draw_plain(const std::function<std::optional<double>(const Sample&)>& value,
                             double least_axis, const std::string& title, ImU32 colour) {
  Chart chart = next();
  Ends ends;
  for (const Sample& s : samples_)
    if (const std::optional<double> v = value(s); v && chart.visible(s.time)) ends.take(*v);
  const double step = ends.round(least_axis, ticks_);
  chart.begin(ends.least, ends.most, step);
  chart.line(samples_, value, colour, LineStyle::Solid);
  chart.unclip();
  chart.title(title, colour);
  chart.frame();
}

void StripCharts::draw_time_axis() {
  const Chart time(list_, {left_, bottom_}, {right_, high_.y}, span_.end, span_.length, scale_);
  if (has_shear_)
    draw_slip_band(list_, {left_, bottom_ + marks_ + 2 * scale_},
                   {right_, bottom_ + marks_ + band_ - 2 * scale_}, time, samples_, scale_);
  const char* title = history_.timeline().timed ? "time [s]" : "frame";
  const float title_left = right_ - ImGui::CalcTextSize(title).x;
  list_->AddText({title_left, high_.y - axis_ + 4 * scale_}, ink(theme().faint), title);
  const double step = nice_ceiling(span_.length / std::max(2.0, (right_ - left_) / (70.0 * scale_)));
  for (double t = std::ceil((span_.end - span_.length) / step) * step; t <= span_.end + 1e-9; t += step) {
    const float x = time.at(t, 0).x;
    list_->AddLine({x, high_.y - axis_}, {x, high_.y - axis_ + 3 * scale_}, ink(theme().frame));
    const std::string label = tick_text(t, step);
    const ImVec2 size = ImGui::CalcTextSize(label.c_str());
    if (x + size.x / 2 > title_left - 6 * scale_) continue;
    list_->AddText({x - size.x / 2, high_.y - axis_ + 4 * scale_}, ink(theme().faint), label.c_str());
  }
}

void StripCharts::draw_events() {
  const Chart time(list_, {left_, bottom_}, {right_, high_.y}, span_.end, span_.length, scale_);
  float free_from = left_;  // of the row of labels; in order of time, none over another
  for (const EventMark& e : history_.events()) {
    if (e.time > span_.end || !time.visible(e.time)) continue;
    const float x = time.at(e.time, 0).x;
    if (x < left_) continue;
    const auto dashes = [&](float from, float to) {
      for (float y = from; y < to; y += 6 * scale_)
        list_->AddLine({x, y}, {x, std::min(y + 3 * scale_, to)}, ink(theme().text, 220), 1.2f * scale_);
    };
    across(dashes);
    const ImVec2 size = ImGui::CalcTextSize(e.label.c_str());
    const float at = std::min(x, right_ - size.x - 3 * scale_), y = bottom_ + scale_;
    if (at < free_from) continue;
    free_from = at + size.x + 6 * scale_;
    list_->AddRectFilled({at, y}, {at + size.x + 3 * scale_, y + size.y}, ink(theme().text, 225));
    list_->AddText({at + scale_, y}, ink(theme().panel), e.label.c_str());
  }
}

/// In a recording: where the shown frame is.
void StripCharts::draw_cursor() {
  if (!history_.timeline().whole()) return;
  const Chart time(list_, {left_, bottom_}, {right_, high_.y}, span_.end, span_.length, scale_);
  const float x = std::clamp(time.at(history_.now(), 0).x, left_, right_);
  across([&](float from, float to) {
    list_->AddLine({x, from}, {x, to}, ink(theme().slips), 1.6f * scale_);
  });
  const float foot = high_.y - axis_;
  list_->AddTriangleFilled({x - 5 * scale_, foot + 6 * scale_}, {x + 5 * scale_, foot + 6 * scale_},
                           {x, foot - scale_}, ink(theme().slips));
}

}  // namespace

double least_shear_axis_N(const Sensor& sensor, const std::deque<Sample>& samples) {
  double noise_N = 0;
  for (const Sample& s : samples)
    if (s.contact)
      for (const Estimate* e : {&s.shear_x_N, &s.shear_y_N})
        if (has_value(*e) && std::isfinite(e->standard_error)) noise_N = std::max(noise_N, e->standard_error);
  const double limit_N = sensor.shear->friction * calibrated_range(*sensor.force).most_N;
  return std::max({0.01, 0.05 * limit_N, 4 * noise_N});
}

double tick_step(double least, double most, int ticks) {
  double step = nice_ceiling((most - least) / std::max(ticks, 1));
  while (step > std::max(most, -least)) step = nice_ceiling(step / 2.5);
  return step;
}

ForceRange calibrated_range(const ForceCalibration& force) {
  return {force_of(force, reading_at(force, force.gray_min)).value,
          force_of(force, reading_at(force, force.gray_max)).value};
}

void draw_strip_charts(ImDrawList* list, const ViewRect& rect, const History& history, const Sensor& sensor,
                       const Tare& tare, const ChartStyle& style) {
  StripCharts(list, rect, history, sensor, tare, style).draw();
}

std::optional<double> time_under(float x, const ViewRect& rect, const History& history,
                                 const ChartStyle& style) {
  const auto [left, right] = axis_ends(rect, style.scale);
  if (x < left || x > right) return std::nullopt;
  const Span span = shown_span(history, style);
  return span.end - span.length * static_cast<double>((right - x) / (right - left));
}

}  // namespace palpate::viz
