// Plot of a shear calibration, as a gnuplot script.
#include <algorithm>
#include <cmath>
#include <tuple>

#include "engine/base/text.h"
#include "viz/report/calibration_plots.h"

namespace palpate {

using Phase = ShearSample::Phase;

std::string plot_script(const ShearOutcome& o, PlotKind kind) {
  const auto block = [](const char* name, const std::string& lines) {
    return std::string("$") + name + " << EOD\n" + (lines.empty() ? "NaN NaN\n" : lines) + "EOD\n";
  };
  std::string sticks[2], rest[2], ratio[2];
  for (size_t i = 0; i < o.samples.size(); ++i) {
    const ShearSample& s = o.samples[i];
    const bool stuck = s.phase == Phase::Sticks;
    (stuck ? sticks : rest)[0] += palpate::text("%.6g %.6g\n", s.ux_mm, s.fx_N);
    (stuck ? sticks : rest)[1] += palpate::text("%.6g %.6g\n", s.uy_mm, s.fy_N);
    if (s.normal_N > 0)
      ratio[s.phase == Phase::Slips] +=
          palpate::text("%zu %.6g\n", i, std::hypot(s.fx_N, s.fy_N) / s.normal_N);
  }
  std::string s = plot_head(kind, 1000, 760);
  s += block("sx", sticks[0]) + block("sy", sticks[1]) + block("rx", rest[0]) + block("ry", rest[1]) +
       block("held", ratio[0]) + block("slid", ratio[1]);
  s += "set key outside below center horizontal samplen 2\nset multiplot\n";
  for (const auto& [axis, stiffness, left] :
       {std::tuple{'x', &o.fit.x, "0"}, std::tuple{'y', &o.fit.y, "0.5"}}) {
    s += palpate::text(
        "set origin %s,0.42\nset size 0.5,0.58\nset title 'K_%c = %.4g +- %.2g N/mm, R² %.5f'\n", left, axis,
        stiffness->k_N_per_mm, stiffness->sd_N_per_mm, stiffness->r_squared);
    s += palpate::text("set xlabel 'shift u_%c, mm'\nset ylabel 'tangential force F_%c, N'\n", axis, axis);
    s += palpate::text(
        "plot $r%c with points pt 6 ps 0.6 lc rgb '#d55e00' title 'after the first slip', $s%c with points "
        "pt 7 "
        "ps 0.5 lc rgb '#0072b2' title 'sticks', [%.6g:%.6g] %.8g*x with lines lw 2 lc rgb '#000000' title "
        "'K u'\n",
        axis, axis, -stiffness->shift_max_mm, stiffness->shift_max_mm, stiffness->k_N_per_mm);
  }
  s += "set origin 0,0\nset size 1,0.43\nset title 'tangential over normal "
       "force'\nset xlabel 'touched "
       "frame'\nset "
       "ylabel '|F_t| / F_z'\nset yrange [0:" +
       palpate::text("%.6g", 1.15 * std::max(o.calibration.friction, o.fit.largest_ratio)) + "]\n";
  s += palpate::text(
      "plot $held with points pt 7 ps 0.4 lc rgb '#0072b2' title 'not used for the friction', $slid with "
      "points "
      "pt 6 ps 0.6 lc rgb '#d55e00' title 'slips', %.8g with lines lw 2 lc rgb '#000000' title 'friction "
      "%.4g'\n"
      "unset multiplot\n",
      o.calibration.friction, o.calibration.friction);
  return s;
}

}  // namespace palpate
