#include "viz/panels/charts/calibration_chart.h"

#include <imgui.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "capture/files/measurements.h"
#include "engine/measure/force.h"
#include "viz/panels/charts/charts.h"
#include "viz/panels/charts/line_style.h"
#include "viz/render/drawing.h"
#include "viz/render/format.h"
#include "viz/render/view_state.h"

namespace palpate::viz {
namespace {

constexpr int kBandAlpha = 90;
constexpr double kFarthest = 3;  // times the calibrated range: marks beyond stay at the chart's edge

ImU32 pale(ImU32 colour) {
  return (colour & ~IM_COL32_A_MASK) | IM_COL32(0, 0, 0, kBandAlpha);
}

struct Axis {
  double least = 0, most = 1;
  double unit = 1;  ///< of its numbers
  /// Distance of its ticks where there is room for so many.
  double step(int ticks) const { return nice_ceiling((most - least) / unit / std::max(ticks, 1)) * unit; }
};

/// A frame with an axis below and one on the left.
class Plot {
 public:
  Plot(ImDrawList* list, const ViewRect& rect, float scale) : list_(list), scale_(scale) {
    const float row = ImGui::GetFontSize();
    outer_low_ = corner(rect);
    outer_high_ = far_corner(rect);
    low_ = {outer_low_.x + 46 * scale, outer_low_.y + row + 5 * scale};
    high_ = {outer_high_.x - 8 * scale, outer_high_.y - 2 * row - 8 * scale};
  }
  void axes(Axis x, Axis y, const std::string& x_title, const std::string& y_title) {
    const float row = ImGui::GetFontSize();
    for (Axis* axis : {&x, &y})
      if (!(axis->most > axis->least)) axis->most = axis->least + 1;
    const double x_step = x.step(static_cast<int>((high_.x - low_.x) / (42 * scale_)));
    const double y_step = y.step(static_cast<int>((high_.y - low_.y) / (1.8f * row)));
    x_ = x;
    y_ = y;
    const auto first = [](const Axis& axis, double step) {
      return std::ceil(axis.least / step - 1e-9) * step;
    };
    list_->AddRectFilled(low_, high_, ink(theme().chart));
    for (double v = first(y, y_step); v <= y.most + 1e-9 * y_step; v += y_step) {
      const float at_y = at(x.least, v).y;
      list_->AddLine({low_.x, at_y}, {high_.x, at_y},
                     std::abs(v) < 1e-9 * y_step ? ink(theme().frame) : ink(theme().grid));
      const std::string label = tick_text(v / y.unit, y_step / y.unit);
      list_->AddText({low_.x - ImGui::CalcTextSize(label.c_str()).x - 4 * scale_, at_y - row / 2},
                     ink(theme().faint), label.c_str());
    }
    for (double v = first(x, x_step); v <= x.most + 1e-9 * x_step; v += x_step) {
      const float at_x = at(v, y.least).x;
      list_->AddLine({at_x, low_.y}, {at_x, high_.y},
                     std::abs(v) < 1e-9 * x_step ? ink(theme().frame) : ink(theme().grid));
      const std::string label = tick_text(v / x.unit, x_step / x.unit);
      list_->AddText({std::min(at_x - ImGui::CalcTextSize(label.c_str()).x / 2,
                               outer_high_.x - ImGui::CalcTextSize(label.c_str()).x),
                      high_.y + 2 * scale_},
                     ink(theme().faint), label.c_str());
    }
    list_->AddText({high_.x - ImGui::CalcTextSize(x_title.c_str()).x, high_.y + row + 3 * scale_},
                   ink(theme().text), x_title.c_str());
    list_->AddText({outer_low_.x, outer_low_.y}, ink(theme().text), y_title.c_str());
    legend_x_ = outer_low_.x + ImGui::CalcTextSize(y_title.c_str()).x + 12 * scale_;
  }
  /// Words of the head line, as far as there is room.
  void legend(const std::string& words, ImU32 colour) {
    const float width = ImGui::CalcTextSize(words.c_str()).x;
    if (legend_x_ + width > outer_high_.x) return;
    list_->AddText({legend_x_, outer_low_.y}, colour, words.c_str());
    legend_x_ += width + 10 * scale_;
  }
  ImVec2 at(double x, double y) const {
    return {low_.x + static_cast<float>((x - x_.least) / (x_.most - x_.least)) * (high_.x - low_.x),
            high_.y - static_cast<float>((y - y_.least) / (y_.most - y_.least)) * (high_.y - low_.y)};
  }
  void clip() { list_->PushClipRect(low_, high_, true); }
  void unclip() {
    list_->PopClipRect();
    list_->AddRect(low_, high_, ink(theme().frame));
  }
  /// A strip of x in which nothing was calibrated.
  void beyond(double from, double to) {
    if (to > from) list_->AddRectFilled({at(from, 0).x, low_.y}, {at(to, 0).x, high_.y}, ink(theme().panel));
  }
  void line(const std::vector<ImVec2>& points, ImU32 colour, LineStyle line_style) {
    StyledLine drawn(list_, colour, line_style, scale_);
    for (size_t i = 1; i < points.size(); ++i) drawn.piece(points[i - 1], points[i]);
  }
  void band(const std::vector<ImVec2>& low, const std::vector<ImVec2>& high, ImU32 colour) {
    for (size_t i = 1; i < low.size(); ++i)
      list_->AddQuadFilled(high[i - 1], high[i], low[i], low[i - 1], pale(colour));
  }
  void upright(double x, ImU32 colour) {
    const float at_x = at(x, 0).x;
    for (float y = low_.y; y < high_.y; y += 9 * scale_)
      list_->AddLine({at_x, y}, {at_x, std::min(y + 5 * scale_, high_.y)}, colour, scale_);
  }
  /// A contact, its error bar of two standard errors, and its words above it on the left or below it on the
  /// right; at the edge where it lies beyond the axes. Hollow where it is not to be trusted.
  void mark(double x, double y, double sd, ImU32 colour, const std::string& words, bool trusted,
            bool left_requested = true) {
    const ImVec2 true_place = at(x, y);
    const float radius = 4.5f * scale_;
    const ImVec2 p{std::clamp(true_place.x, low_.x + radius, high_.x - radius),
                   std::clamp(true_place.y, low_.y + radius, high_.y - radius)};
    const float top = std::max(at(x, y + 2 * sd).y, low_.y), foot = std::min(at(x, y - 2 * sd).y, high_.y);
    if (foot > top) list_->AddLine({p.x, top}, {p.x, foot}, colour, 1.5f * scale_);
    list_->AddCircleFilled(p, radius + 1.5f * scale_, ink(theme().chart, 200));
    if (trusted)
      list_->AddCircleFilled(p, radius, colour);
    else
      list_->AddCircle(p, radius, colour, 0, 2 * scale_);
    const ImVec2 size = ImGui::CalcTextSize(words.c_str());
    const float left = p.x - radius - size.x - 5 * scale_;  // above the curve there is room on the left
    const bool above = left_requested && left > low_.x;     // else below it on the right
    const float words_x = above ? left : std::min(p.x + radius + 5 * scale_, high_.x - size.x - 2);
    const float words_y = std::clamp(above ? p.y - size.y - 1 : p.y + 2, low_.y, high_.y - size.y);
    list_->AddRectFilled({words_x - 2, words_y}, {words_x + size.x + 2, words_y + size.y},
                         ink(theme().panel, 190));
    list_->AddText({words_x, words_y}, colour, words.c_str());
  }
  const Axis& x() const { return x_; }
  const Axis& y() const { return y_; }
  float width() const { return high_.x - low_.x; }

 private:
  ImDrawList* list_;
  float scale_;
  ImVec2 outer_low_{}, outer_high_{}, low_{}, high_{};
  float legend_x_ = 0;
  Axis x_, y_;
};

std::string force_words(const CalibrationMark& mark) {
  std::string words = mark.id > 0 ? text("%u: ", mark.id) : "";
  words += text("%.3f \xc2\xb1 %.3f N", mark.force_N.value, mark.force_N.standard_error);
  if (mark.force_N.validity != Validity::Valid) words += std::string(", ") + to_string(mark.force_N.validity);
  return words;
}

}  // namespace

SignalAxis signal_axis(ForceSignal signal, double most) {
  const auto [name, unit] = [signal]() -> std::pair<std::string, std::string> {
    switch (signal) {
      case ForceSignal::Area:
        return {"contact area", "px"};
      case ForceSignal::Volume:
        return {"indented volume", "mm\xc2\xb3"};
      case ForceSignal::Gradient:
        return {"sum of gradients", "gray levels \xc3\x97 px"};
      case ForceSignal::Layer:
        return {"force by the layer", "N"};
      case ForceSignal::LayerAndBending:
        return {"force by layer and bending", "N"};
      default:
        return {"gray sum", "gray levels"};
    }
  }();
  if (most >= 2e6) return {1e6, name + " [million " + unit + "]"};
  if (most >= 2e3) return {1e3, name + " [1000 " + unit + "]"};
  return {1, name + " [" + unit + "]"};
}

std::vector<CurvePoint> force_curve(const ForceCalibration& calibration, Branch branch, double first,
                                    double last, size_t count) {
  std::vector<CurvePoint> points;
  points.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    const double signal = first + (last - first) * static_cast<double>(i) / static_cast<double>(count - 1);
    const Estimate e =
        force_of(calibration, reading_at(calibration, signal), branch == Branch::Unloading ? 1 : 0);
    points.push_back({signal, e.value, e.standard_error});
  }
  return points;
}

std::vector<CalibrationMark> force_marks(const ForceCalibration& calibration, const Touch& touch) {
  std::vector<CalibrationMark> marks;
  for (const ContactTouch& c : touch.contacts)
    if (touch.contacts.size() > 1 && has_value(c.force_N))
      marks.push_back({c.id, signal_of(calibration, force_features(c)), c.force_N});
  const bool of_whole = calibration.signal == ForceSignal::Volume ||
                        calibration.signal == ForceSignal::Gradient || is_by_layer(calibration.signal);
  if (marks.empty() && touch.contact && (of_whole || touch.contacts.size() < 2) && has_value(touch.force_N))
    marks.push_back({0, signal_of(calibration, force_features(touch)), touch.force_N});
  return marks;
}

std::vector<CalibrationMark> shear_marks(const ShearCalibration& calibration, const Touch& touch,
                                         bool along_x) {
  std::vector<CalibrationMark> marks;
  const bool by_skin = calibration.signal == ShearSignal::Skin;
  if (touch.contacts.size() > 1) {
    for (const ContactTouch& c : touch.contacts) {
      const Estimate& force_N = along_x ? c.shear_x_N : c.shear_y_N;
      if (!by_skin && has_value(force_N))
        marks.push_back({c.id, along_x ? c.shift_x_mm : c.shift_y_mm, force_N});
    }
    return marks;
  }
  const Estimate& force_N = along_x ? touch.shear_x_N : touch.shear_y_N;
  if (!touch.contact || !has_value(force_N)) return marks;
  const SkinMotion skin = touch.skin.value_or(SkinMotion{});
  const Estimate& skin_mm = along_x ? skin.shift_x_mm : skin.shift_y_mm;
  const double shift_mm = by_skin && skin.touching >= 3 ? skin_mm.value
                          : along_x                     ? touch.shift_x_mm
                                                        : touch.shift_y_mm;
  marks.push_back({0, shift_mm, force_N});
  return marks;
}

void draw_force_calibration(ImDrawList* list, const ViewRect& rect, const ForceCalibration& calibration,
                            const Touch& touch, float scale) {
  const ForceCalibration& c = calibration;
  const std::vector<CalibrationMark> marks = force_marks(c, touch);
  Axis x{0, 1.06 * c.gray_max, 1}, y{0, 0, 1};
  for (const CalibrationMark& m : marks)
    x.most = std::max(x.most, std::min(1.06 * m.signal, kFarthest * c.gray_max));
  const SignalAxis signal = signal_axis(c.signal, x.most);
  x.unit = signal.unit;
  const bool branches = c.loading && c.unloading;
  for (const Branch branch : {Branch::Loading, Branch::Unloading})
    for (const CurvePoint& p : force_curve(c, branch, c.gray_min, x.most, 40)) {
      y.most = std::max(y.most, p.force_N + 2 * p.standard_error_N);
      if (p.signal <= c.gray_max) y.least = std::min(y.least, p.force_N - 2 * p.standard_error_N);
    }
  y.most *= 1.04;
  Plot plot(list, rect, scale);
  plot.axes(x, y, signal.title, "force [N]");
  plot.clip();
  plot.beyond(plot.x().least, c.gray_min);
  plot.beyond(c.gray_max, plot.x().most);
  const auto curve = [&](Branch branch, ImU32 colour, LineStyle line_style) {
    const auto part = [&](double from, double to, bool calibrated) {
      if (!(to > from)) return;
      const auto count = static_cast<size_t>(
          std::max(2.0, plot.width() * (to - from) / (plot.x().most - plot.x().least) / scale));
      std::vector<ImVec2> middle, low, high;
      for (const CurvePoint& p : force_curve(c, branch, from, to, count)) {
        middle.push_back(plot.at(p.signal, p.force_N));
        low.push_back(plot.at(p.signal, p.force_N - 2 * p.standard_error_N));
        high.push_back(plot.at(p.signal, p.force_N + 2 * p.standard_error_N));
      }
      if (calibrated) plot.band(low, high, colour);
      plot.line(middle, calibrated ? colour : ink(theme().faint),
                calibrated ? line_style : LineStyle::Dotted);
    };
    part(plot.x().least, c.gray_min, false);
    part(c.gray_min, c.gray_max, true);
    part(c.gray_max, plot.x().most, false);
  };
  curve(Branch::Loading, ink(theme().chosen), LineStyle::Solid);
  if (branches) curve(Branch::Unloading, ink(theme().second), LineStyle::Dashed);
  plot.upright(c.gray_min, ink(theme().limit));
  plot.upright(c.gray_max, ink(theme().limit));
  for (const CalibrationMark& m : marks)
    plot.mark(m.signal, m.force_N.value, m.force_N.standard_error, ink(theme().text), force_words(m),
              m.force_N.validity == Validity::Valid);
  plot.unclip();
  if (branches) {
    plot.legend("loading", ink(theme().chosen));
    plot.legend("unloading (dashed)", ink(theme().second));
  }
  const ForceRange range = calibrated_range(c);
  plot.legend(text("calibrated %.3g to %.3g N", range.least_N, range.most_N), ink(theme().limit));
  plot.legend("band: 95 %", ink(theme().faint));
}

void draw_shear_calibration(ImDrawList* list, const ViewRect& rect, const ShearCalibration& calibration,
                            std::optional<double> largest_N, const Touch& touch, float scale) {
  const ShearCalibration& c = calibration;
  const double stiffness = std::max(c.kx_N_per_mm, c.ky_N_per_mm);
  const bool pressed = touch.contact && has_value(touch.force_N) && touch.contacts.size() < 2;
  const std::optional<double> normal_N =
      pressed ? std::optional(std::max(touch.force_N.value, 0.0)) : largest_N;
  // Range of the chart: the calibrated range, else the friction limit, else a millimetre.
  const double reach_mm = c.shift_max_mm > 0 ? c.shift_max_mm
                          : largest_N        ? 1.3 * c.friction * *largest_N / stiffness
                                             : 1;
  Axis x{-1.06 * reach_mm, 1.06 * reach_mm, 1};
  double most_N = stiffness * reach_mm * (1 + 2 * c.relative_sd);
  for (const bool along_x : {true, false})
    for (const CalibrationMark& m : shear_marks(c, touch, along_x)) {
      x.most = std::max(x.most, std::min(1.06 * std::abs(m.signal), kFarthest * reach_mm));
      most_N = std::max(most_N, std::min(1.06 * std::abs(m.force_N.value), kFarthest * stiffness * reach_mm));
    }
  x.least = -x.most;
  if (normal_N && c.friction * *normal_N < 2 * most_N) most_N = std::max(most_N, c.friction * *normal_N);
  most_N *= 1.08;
  Plot plot(list, rect, scale);
  plot.axes(x, {-most_N, most_N, 1},
            c.signal == ShearSignal::Skin ? "shift of the skin [mm]" : "shift of the centroid [mm]",
            "shear [N]");
  plot.clip();
  if (c.shift_max_mm > 0) {
    plot.beyond(plot.x().least, -c.shift_max_mm);
    plot.beyond(c.shift_max_mm, plot.x().most);
  }
  for (const bool along_x : {true, false}) {
    const double k = along_x ? c.kx_N_per_mm : c.ky_N_per_mm;
    const ImU32 colour = along_x ? ink(theme().second) : ink(theme().third);
    std::vector<ImVec2> middle, low, high;
    const auto count = static_cast<size_t>(std::max(2.0f, plot.width() / scale));
    for (size_t i = 0; i < count; ++i) {
      const double shift_mm = reach_mm * (2 * static_cast<double>(i) / static_cast<double>(count - 1) - 1);
      middle.push_back(plot.at(shift_mm, k * shift_mm));
      low.push_back(plot.at(shift_mm, k * shift_mm * (1 - 2 * c.relative_sd)));
      high.push_back(plot.at(shift_mm, k * shift_mm * (1 + 2 * c.relative_sd)));
    }
    plot.band(low, high, colour);
    plot.line(middle, colour, along_x ? LineStyle::Solid : LineStyle::Dashed);
  }
  if (normal_N)
    for (const double sign : {-1.0, 1.0}) {
      const double limit_N = sign * c.friction * *normal_N;
      plot.line({plot.at(plot.x().least, limit_N), plot.at(plot.x().most, limit_N)}, ink(theme().limit),
                LineStyle::Dotted);
    }
  for (const bool along_x : {true, false})
    for (const CalibrationMark& m : shear_marks(c, touch, along_x)) {
      const std::string name = along_x ? "x" : "y";
      plot.mark(m.signal, m.force_N.value, m.force_N.standard_error,
                along_x ? ink(theme().second) : ink(theme().third),
                m.id > 0 ? text("%s of %u", name.c_str(), m.id) : name, m.force_N.validity == Validity::Valid,
                !along_x);
    }
  plot.unclip();
  plot.legend("x", ink(theme().second));
  plot.legend("y (dashed)", ink(theme().third));
  if (normal_N)
    plot.legend(text("limit at %.3g N: %.3g N", *normal_N, c.friction * *normal_N), ink(theme().limit));
}

}  // namespace palpate::viz
