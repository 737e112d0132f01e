// Plot of a force calibration.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/text.h"
#include "viz/report/calibration_plots.h"

namespace palpate {
namespace {

constexpr int kSteps = 160;  // of a drawn curve

const char* axis_of(ForceSignal signal) {
  switch (signal) {
    case ForceSignal::GraySum:
      return "gray sum G, gray levels";
    case ForceSignal::Area:
      return "contact area, px";
    case ForceSignal::Volume:
      return "indented volume, mm³";
    case ForceSignal::Gradient:
      return "gradients over the frame, gray levels x px";
    case ForceSignal::Layer:
      return "force by the elastic layer, N";
    case ForceSignal::LayerAndBending:
      return "force by the elastic layer and by bending, N";
  }
  return "";
}

}  // namespace

Plot plot_of(const ForceOutcome& o) {
  const ForceCalibration& c = o.choice.calibration;
  using Style = PlotCurve::Style;
  PlotPanel readings{verdict_of(o).line + "\n" +
                         text("%s: R² %.5f, held-out error %.3g N, 95 %% interval +- %.3g N at %.3g N",
                              to_string(o.choice.chosen.candidate).c_str(), c.r_squared,
                              o.choice.chosen.error_N, o.choice.interval_full_N, c.force_max_N),
                     axis_of(c.signal), "normal force, N"};
  readings.key = "top left";
  PlotPanel residuals{"", axis_of(c.signal), ""};
  PlotCurve points[] = {{"loading", {}, {}, Style::Points, 0},
                        {"unloading", {}, {}, Style::Points, 1},
                        {"left out", {}, {}, Style::Points, kPlotGray}};
  points[1].mark = 6;
  points[2].mark = 2;
  PlotCurve rest[] = {points[0], points[1], points[2]};
  for (PlotCurve& curve : rest) curve.title.clear();
  double largest_mN = 0;
  for (size_t i = 0; i < o.samples.size(); ++i) {
    const ForceSample& s = o.samples[i];
    if (!std::isfinite(s.force_N)) continue;
    const double w = o.choice.unloading_fraction[i], x = signal_of(c, s.features);
    const double residual_mN = 1e3 * (s.force_N - force_of(c, s.features, w).value);
    const bool used = s.left_out == LeftOut::Used;
    if (used) largest_mN = std::max(largest_mN, std::abs(residual_mN));
    const size_t branch = !used ? 2 : w > 0.5 ? 1 : 0;
    points[branch].add(x, s.force_N);
    rest[branch].add(x, residual_mN);
  }
  PlotCurve up{.title = c.loading ? "loading curve, 95 %" : "curve, 95 %",
               .colour = c.loading ? 0 : kPlotBlack},
      down{.title = "unloading curve", .colour = 7, .dashed = true}, zero{.colour = kPlotBlack, .width = 1};
  for (int k = 0; k <= kSteps; ++k) {
    const double x = c.gray_min + (c.gray_max - c.gray_min) * k / kSteps;
    const Estimate e = force_of(c, reading_at(c, x), 0);
    const double interval_N = 1.96 * e.standard_error;
    up.add(x, e.value, e.value - interval_N, e.value + interval_N);
    down.add(x, force_of(c, reading_at(c, x), 1).value);
    zero.add(x, 0, -1e3 * interval_N, 1e3 * interval_N);
    largest_mN = std::max(largest_mN, 1e3 * interval_N);
  }
  const bool newtons = largest_mN > 500;  // else residuals are shown in mN
  const double unit = newtons ? 1e-3 : 1;
  for (PlotCurve* curve : {&rest[0], &rest[1], &zero})
    for (auto* column : {&curve->y, &curve->low, &curve->high}) *column = plot_scaled(*column, unit);
  if (c.gray_max > 1e4) {
    readings.x_label = residuals.x_label += ", in thousands";
    for (PlotCurve* curve : {&up, &down, &zero, &points[0], &points[1], &points[2], &rest[0], &rest[1]})
      curve->x = plot_scaled(curve->x, 1e-3);
  }
  readings.curves = {up, points[0], points[1], points[2]};
  if (c.loading) readings.curves.push_back(down);
  residuals.curves = {zero, rest[0], rest[1]};
  residuals.y_label = std::string("gauge - curve, ") + (newtons ? "N" : "mN");
  residuals.y_range = {{-1.15 * unit * largest_mN, 1.15 * unit * largest_mN}};
  return {.panels = {readings, residuals}, .width_px = 900, .height_px = 820};
}

}  // namespace palpate
