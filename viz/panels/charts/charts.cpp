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

constexpr int kChartBandAlpha = 70, kWithinAlpha = 34;

constexpr double kLeastDepthAxis_mm = 0.05;  // as the colours of depth
constexpr double kLeastErrors = 6;           // standard errors that an axis shows at least

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

/// "0.51 ± 0.01 N"; "-" where it is not known.
std::string value_text(const Estimate& e, const char* unit, int places = 3) {
  if (!has_value(e) || !std::isfinite(e.value)) return "-";
  const std::string error = e.standard_error > 0 ? text(" \xc2\xb1 %.*f", places, e.standard_error) : "";
  return text("%.*f", places, e.value) + error + (*unit ? " " : "") + unit;
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
    if (style.cursor && *style.cursor <= span_.end && *style.cursor >= span_.end - span_.length)
      find_cursor(*style.cursor);
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
      draw_plain(
          [](const Sample& s) {
            return Estimate{1e-3 * s.gray_sum, 0, Validity::Valid};
          },
          std::max(0.01, 0.1 * sensor_.threshold_gray), "gray sum G [1000 gray levels], force not calibrated",
          ink(theme().chosen));
    if (has_shear_ && index_ < count_) draw_shear();
    if (has_depth_ && index_ < count_)
      draw_plain(
          [](const Sample& s) {
            return Estimate{s.depth_mm, s.depth_sd_mm,
                            s.has_depth ? Validity::Valid : Validity::NotCalibrated};
          },
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
  Chart axis() const { return {list_, {left_, bottom_}, {right_, high_.y}, span_.end, span_.length, scale_}; }
  /// A vertical line through all charts, between the words above them.
  template <typename Line>
  void across(Line line) const {
    for (int i = 0; i < index_; ++i) {
      const float y = low_.y + static_cast<float>(i) * each_;
      line(y + head_, y + each_ - 2 * scale_);
    }
  }
  /// The line that is read; at a sample where there is one near.
  void find_cursor(double time) {
    cursor_ = time;
    const double reach = 40 * scale_ * span_.length / static_cast<double>(right_ - left_);
    for (const Sample& s : samples_)
      if (const double away = std::abs(s.time - time);
          away <= reach && (!read_ || away < std::abs(read_->time - time)))
        read_ = &s;
    if (read_) cursor_ = read_->time;
  }
  /// What the chart has there, at the end of the words above it.
  void read(Chart& chart, const std::string& words) const {
    if (cursor_) chart.note(read_ ? words : "-", ink(theme().text));
  }
  /// The largest standard error of what is shown, times those that an axis shows at least.
  template <typename Find>
  double least_by_error(const Chart& chart, Find find) const {
    double most = 0;
    for (const Sample& s : samples_)
      if (const Estimate e = find(s);
          chart.visible(s.time) && has_value(e) && std::isfinite(e.standard_error))
        most = std::max(most, e.standard_error);
    return kLeastErrors * most;
  }
  /// A ring around the largest of what is shown, with its value and time behind the words above the chart.
  void mark_largest(Chart& chart, const std::function<Estimate(const Sample&)>& value,
                    const char* unit) const {
    const Sample* largest = largest_of(samples_, span_, value);
    if (!largest) return;
    const Estimate e = value(*largest);
    list_->AddCircle(chart.at(largest->time, e.value), 3.5f * scale_, ink(theme().text), 0, scale_);
    chart.title("largest " + value_text(e, unit) +
                    text(history_.timeline().timed ? " at %.2f s" : " at frame %.0f", largest->time),
                ink(theme().text));
    if (e.validity != Validity::Valid) chart.title(to_string(e.validity), ink(theme().doubtful));
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
  void draw_plain(const std::function<Estimate(const Sample&)>& value, double least_axis,
                  const std::string& title, ImU32 colour);
  void draw_time_axis();
  void draw_events();
  void draw_cursor();
  std::tuple<std::string, float, float> cursor_label() const;

  ImDrawList* list_;
  const History& history_;
  const std::deque<Sample>& samples_;
  const Sensor& sensor_;
  const Tare& tare_;
  float scale_;
  ImVec2 low_, high_;
  TimeSpan span_;
  bool has_shear_;  // without a force there is no friction limit, and shear is not drawn
  bool has_depth_;
  float left_ = 0, right_ = 0, axis_ = 0, band_ = 0, marks_ = 0, bottom_ = 0, head_ = 0, each_ = 0;  // px
  int count_ = 0, index_ = 0, ticks_ = 0;
  std::optional<double> cursor_;  ///< time that is read
  const Sample* read_ = nullptr;  ///< the sample there; none: nothing was measured near
};

/// Where no calibration says the force and the elastic layer does.
void StripCharts::draw_layer_force() {
  constexpr double kLeastAxis_N = 0.05;
  Chart chart = next();
  const auto band = [](const Sample& s) { return s.layer_N ? interval(*s.layer_N) : std::nullopt; };
  AxisRange ends;
  const auto layer = [](const Sample& s) { return s.layer_N.value_or(Estimate{}); };
  for (const Sample& s : samples_)
    if (chart.visible(s.time)) ends.take(band(s));
  const double step = ends.round(std::max(kLeastAxis_N, least_by_error(chart, layer)), ticks_);
  chart.begin(ends.least, ends.most, step);
  chart.band(samples_, band, ink(theme().chosen, kChartBandAlpha));
  chart.line(
      samples_,
      [&](const Sample& s) -> std::optional<double> {
        if (band(s)) return s.layer_N->value;
        return s.contact ? std::nullopt : std::optional(0.0);
      },
      ink(theme().chosen), LineStyle::Solid);
  chart.unclip();
  read(chart, read_ ? value_text(layer(*read_), "N") : "");
  chart.title("force by the layer [N], band: 95 %", ink(theme().chosen));
  mark_largest(chart, layer, "N");
  chart.frame();
}

void StripCharts::draw_force() {
  Chart chart = next();
  AxisRange ends;
  const ForceRange range = calibrated_range(*sensor_.force);
  const double zero_N = tare_.on && has_value(tare_.force_N) ? tare_.force_N.value : 0;
  for (const Sample& s : samples_)
    if (chart.visible(s.time) && s.contact) ends.take(interval(force(s)));
  // The limits, of one contact, come into sight when its force comes near them.
  const bool limits = std::none_of(samples_.begin(), samples_.end(),
                                   [&](const Sample& s) { return chart.visible(s.time) && s.several; });
  if (limits && ends.most > 0.6 * (range.most_N - zero_N)) ends.take(1.02 * (range.most_N - zero_N));
  const double least_N = std::max(least_force_axis_N(*sensor_.force),
                                  least_by_error(chart, [this](const Sample& s) { return force(s); }));
  const double step = ends.round(least_N, ticks_);
  chart.begin(ends.least, ends.most, step);
  chart.band(
      samples_, [&](const Sample& s) { return interval(force(s)); }, ink(theme().chosen, kChartBandAlpha));
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
  read(chart, read_ ? value_text(force(*read_), "N") : "");
  chart.title(text("force [N]%s, band: 95 %%", zeroed()), ink(theme().chosen));
  const std::string from = lower ? text("from %.3g ", range.least_N) : "";
  if (limits)
    chart.note(
        text("calibrated %sto %.3g N (dashed)%s", from.c_str(), range.most_N, tare_.on ? ", untared" : ""),
        ink(theme().limit));
  mark_largest(
      chart, [this](const Sample& s) { return force(s); }, "N");
  chart.frame();
}

void StripCharts::draw_shear() {
  Chart chart = next();
  AxisRange ends;
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
  read(chart,
       read_ ? "x " + value_text(shear(*read_, true), "N") + ",  y " + value_text(shear(*read_, false), "N")
             : "");
  chart.title(text("shear [N]%s: x", zeroed()), ink(theme().second));
  chart.title("y (dashed)", ink(theme().third));
  if (!tare_.on) chart.note("area: within the friction limit", ink(theme().limit));
  chart.frame();
}

/// One line, from zero on.
void StripCharts::draw_plain(const std::function<Estimate(const Sample&)>& value, double least_axis,
                             const std::string& title, ImU32 colour) {
  Chart chart = next();
  AxisRange ends;
  for (const Sample& s : samples_)
    if (const Estimate v = value(s); has_value(v) && chart.visible(s.time)) ends.take(v.value);
  const double step = ends.round(std::max(least_axis, least_by_error(chart, value)), ticks_);
  chart.begin(ends.least, ends.most, step);
  chart.line(
      samples_,
      [&](const Sample& s) {
        const Estimate v = value(s);
        return has_value(v) ? std::optional(v.value) : std::nullopt;
      },
      colour, LineStyle::Solid);
  chart.unclip();
  read(chart, read_ ? value_text(value(*read_), "") : "");
  chart.title(title, colour);
  chart.frame();
}

void StripCharts::draw_time_axis() {
  const Chart time = axis();
  if (has_shear_)
    draw_slip_band(list_, {left_, bottom_ + marks_ + 2 * scale_},
                   {right_, bottom_ + marks_ + band_ - 2 * scale_}, time, samples_, scale_);
  const auto [words, from, to] = cursor_label();
  const Chart row(list_, {left_, high_.y - axis_}, {right_, high_.y}, span_.end, span_.length, scale_);
  row.time_ticks(history_.timeline().timed ? "time [s]" : "frame", {from, to});
}

/// A pole through all charts with a pennant in the row below them, and the text where it has room; under the
/// mouse it stands with the time.
void StripCharts::draw_events() {
  const Chart time = axis();
  float free_from = left_;  // of that row; in order of time, none over another
  for (const EventMark& e : history_.events()) {
    if (e.time > span_.end || !time.visible(e.time)) continue;
    const float x = time.at(e.time, 0).x;
    if (x < left_) continue;
    const float y = bottom_ + scale_, side = ImGui::GetFontSize();
    const auto dashes = [&](float from, float to) {
      for (float at = from; at < to; at += 6 * scale_)
        list_->AddLine({x, at}, {x, std::min(at + 3 * scale_, to)}, ink(theme().text, 220), 1.2f * scale_);
    };
    across(dashes);
    const ImVec2 size = ImGui::CalcTextSize(e.label.c_str());
    const float pennant = side / 2, words = pennant + size.x + 6 * scale_;
    // At the right end the flag flies to the left.
    const bool left = x + words > right_;
    const float from = left ? x - words : x;
    list_->AddLine({x, y}, {x, y + side}, ink(theme().text), 1.5f * scale_);
    list_->AddTriangleFilled({x, y}, {x + (left ? -pennant : pennant), y + side / 4}, {x, y + side / 2},
                             ink(theme().text));
    if (from < free_from) {
      free_from = std::max(free_from, x + pennant);
      continue;
    }
    free_from = left ? x : from + words;
    list_->AddText({left ? from : x + pennant + 2 * scale_, y}, ink(theme().text), e.label.c_str());
  }
}

/// In a recording where the shown frame is; and the line that is read.
void StripCharts::draw_cursor() {
  const Chart time = axis();
  const auto line = [&](float x, Rgb colour) {
    across([&](float from, float to) { list_->AddLine({x, from}, {x, to}, ink(colour), 1.6f * scale_); });
  };
  const float foot = high_.y - axis_;
  if (history_.timeline().whole()) {
    const float place = time.at(history_.now(), 0).x, x = std::clamp(place, left_, right_);
    if (x == place) line(x, theme().slips);  // else it is beyond that end
    list_->AddTriangleFilled({x - 5 * scale_, foot + 6 * scale_}, {x + 5 * scale_, foot + 6 * scale_},
                             {x, foot - scale_}, ink(theme().slips));
  }
  if (!cursor_) return;
  line(time.at(*cursor_, 0).x, theme().text);
  const auto [words, from, to] = cursor_label();
  list_->AddRectFilled({from, foot + 2 * scale_}, {to, high_.y}, ink(theme().text));
  list_->AddText({from + 3 * scale_, foot + 3 * scale_}, ink(theme().panel), words.c_str());
}

/// The time that is read with the events there, from its left to its right end; empty without one.
std::tuple<std::string, float, float> StripCharts::cursor_label() const {
  if (!cursor_) return {};
  const Chart time = axis();
  const float x = time.at(*cursor_, 0).x;
  std::string words = text(history_.timeline().timed ? "%.3f s" : "%.0f", *cursor_);
  for (const EventMark& e : history_.events())
    if (std::abs(time.at(e.time, 0).x - x) < 6 * scale_) words += "  " + e.label;
  const float width = ImGui::CalcTextSize(words.c_str()).x + 6 * scale_;
  const float from = std::clamp(x - width / 2, low_.x, std::max(low_.x, high_.x - width));
  return {words, from, from + width};
}

}  // namespace

void draw_strip_charts(ImDrawList* list, const ViewRect& rect, const History& history, const Sensor& sensor,
                       const Tare& tare, const ChartStyle& style) {
  StripCharts(list, rect, history, sensor, tare, style).draw();
}

}  // namespace palpate::viz
