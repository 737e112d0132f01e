// Plot of a shear calibration.
#include <algorithm>
#include <cmath>

#include "engine/base/text.h"
#include "viz/report/calibration_plots.h"

namespace palpate {

using Phase = ShearSample::Phase;

Plot plot_of(const ShearOutcome& o) {
  constexpr auto kPoints = PlotCurve::Style::Points;
  PlotCurve rest[2], sticks[2], held{"not used for the friction", {}, {}, kPoints},
      slid{"slips", {}, {}, kPoints, 1};
  for (PlotCurve* curve : {&rest[0], &rest[1]}) *curve = {"after the first slip", {}, {}, kPoints, 1};
  for (PlotCurve* curve : {&sticks[0], &sticks[1]}) *curve = {"sticks", {}, {}, kPoints};
  for (PlotCurve* curve : {&rest[0], &rest[1], &slid}) curve->mark = 6;
  for (size_t i = 0; i < o.samples.size(); ++i) {
    const ShearSample& s = o.samples[i];
    auto& curves = s.phase == Phase::Sticks ? sticks : rest;
    curves[0].add(s.ux_mm, s.fx_N);
    curves[1].add(s.uy_mm, s.fy_N);
    if (s.normal_N > 0)
      (s.phase == Phase::Slips ? slid : held)
          .add(static_cast<double>(i), std::hypot(s.fx_N, s.fy_N) / s.normal_N);
  }
  Plot plot{.across = 3, .width_px = 1500, .height_px = 520};
  for (const size_t axis : {0, 1}) {
    const auto& stiffness = axis ? o.fit.y : o.fit.x;
    const char letter = axis ? 'y' : 'x';
    PlotPanel panel{palpate::text("K_%c = %.4g +- %.2g N/mm, R² %.5f", letter, stiffness.k_N_per_mm,
                                  stiffness.sd_N_per_mm, stiffness.r_squared),
                    palpate::text("shift u_%c, mm", letter),
                    palpate::text("tangential force F_%c, N", letter),
                    "",
                    {rest[axis], sticks[axis]}};
    const double far_mm = stiffness.shift_max_mm, far_N = stiffness.k_N_per_mm * far_mm;
    panel.add("K u", {-far_mm, far_mm}, {-far_N, far_N}, kPlotBlack);
    plot.panels.push_back(panel);
  }
  const double friction = o.calibration.friction, last = static_cast<double>(o.samples.size());
  PlotPanel ratio{"tangential over normal force", "touched frame", "|F_t| / F_z", "", {held, slid}};
  ratio.add(palpate::text("friction %.4g", friction), {0, last}, {friction, friction}, kPlotBlack);
  ratio.y_range = {{0, 1.15 * std::max(friction, o.fit.largest_ratio)}};
  plot.panels.push_back(ratio);
  for (PlotPanel& panel : plot.panels) panel.key = "outside top center horizontal";
  return plot;
}

}  // namespace palpate
