// Plot of a force calibration, as a gnuplot script.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "engine/base/text.h"
#include "viz/report/calibration_plots.h"

namespace palpate {
namespace {

constexpr int kWidth = 900, kHeight = 820;
constexpr int kSteps = 160;     // of a drawn curve
constexpr size_t kTitle = 100;  // letters of a line

std::string number(double value) {
  const std::string line = text("%.7g", value);
  return line;
}

std::string block(const char* name, const std::string& lines) {
  return std::string("$") + name + " << EOD\n" + (lines.empty() ? "NaN NaN NaN NaN\n" : lines) + "EOD\n";
}

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
  }
  return "";
}

}  // namespace

std::string plot_script(const ForceOutcome& o, PlotKind kind) {
  const ForceCalibration& c = o.choice.calibration;
  // Points: signal, force, residual; by branch. Points that were left out are shown too.
  std::string loading, unloading, left_out, curve[2], band;
  double largest_mN = 0;
  for (size_t i = 0; i < o.samples.size(); ++i) {
    const ForceSample& s = o.samples[i];
    if (!std::isfinite(s.force_N)) continue;
    const double w = o.choice.unloading_fraction[i], x = signal_of(c, s.features);
    const double residual_mN = 1e3 * (s.force_N - force_of(c, s.features, w).value);
    const bool used = s.left_out == LeftOut::Used;
    if (used) largest_mN = std::max(largest_mN, std::abs(residual_mN));
    (!used     ? left_out
     : w > 0.5 ? unloading
               : loading) += number(x) + " " + number(s.force_N) + " " + number(residual_mN) + "\n";
  }
  for (int k = 0; k <= kSteps; ++k) {
    const double x = c.gray_min + (c.gray_max - c.gray_min) * k / kSteps;
    for (const int side : {0, 1}) {
      const Estimate e = force_of(c, reading_at(x), side);
      curve[side] += number(x) + " " + number(e.value) + "\n";
    }
    const Estimate e = force_of(c, reading_at(x), 0);
    band += number(x) + " " + number(e.value - 1.96 * e.standard_error) + " " +
            number(e.value + 1.96 * e.standard_error) + " " + number(1960 * e.standard_error) + "\n";
    largest_mN = std::max(largest_mN, 1960 * e.standard_error);
  }
  const bool newtons = largest_mN > 500;
  const std::string scale = newtons ? "(1e-3*$3)" : "3", band_scale = newtons ? "1e-3*" : "";
  const std::string title = text("%s: R² %.5f, held-out error %.3g N, 95 %% interval +- %.3g N at %.3g N",
                                 to_string(o.choice.chosen.candidate).c_str(), c.r_squared,
                                 o.choice.chosen.error_N, o.choice.interval_full_N, c.force_max_N);
  std::string s = plot_head(kind, kWidth, kHeight);
  s += block("loading", loading) + block("unloading", unloading) + block("out", left_out) +
       block("up", curve[0]) + block("down", curve[1]) + block("band", band);
  s +=
      "set multiplot\nset lmargin 11\nset rmargin 3\nset format x '" +
      std::string(c.signal == ForceSignal::Volume || c.signal == ForceSignal::Layer ? "%.3g" : "%.1s%c") +
      "'\n"
      "set origin 0,0.36\nset size 1,0.64\nset key top left samplen 2\n"
      "set title " +
      plot_lines(verdict_of(o).line, kTitle) + " offset 0,0.8\nset label 1 " + plot_words(title) +
      " at graph 0.5,1.03 center font ',9' textcolor rgb '#555555'\nset ylabel 'normal force, N'\nset xlabel "
      "''\n";
  s += "plot $band using 1:2:3 with filledcurves fc rgb '#d0e4f2' title '95 % interval', "
       "$loading using 1:2 with points pt 7 ps 0.5 lc rgb '#0072b2' title 'loading', "
       "$unloading using 1:2 with points pt 6 ps 0.6 lc rgb '#d55e00' title 'unloading', "
       "$out using 1:2 with points pt 2 ps 0.6 lc rgb '#888888' title 'left out', ";
  if (c.loading)
    s += "$up with lines lw 2 lc rgb '#004b76' title 'loading curve', "
         "$down with lines lw 2 dt 2 lc rgb '#8f3f00' title 'unloading curve'\n";
  else
    s += "$up with lines lw 2 lc rgb '#000000' title 'curve'\n";
  s += "unset label 1\nset origin 0,0\nset size 1,0.37\nset title ''\nset key off\nset xlabel '" +
       std::string(axis_of(c.signal)) + "'\nset ylabel 'gauge - curve, " + (newtons ? "N" : "mN") +
       "'\nset yrange [" + number(-1.15 * largest_mN * (newtons ? 1e-3 : 1)) + ":" +
       number(1.15 * largest_mN * (newtons ? 1e-3 : 1)) + "]\n";
  s += "plot $band using 1:(-" + band_scale + "$4):(" + band_scale +
       "$4) with filledcurves fc rgb '#d0e4f2', 0 with lines lc rgb '#000000', $loading using 1:" + scale +
       " with points pt 7 ps 0.5 lc rgb '#0072b2', $unloading using 1:" + scale +
       " with points pt 6 ps 0.6 lc rgb '#d55e00'\nunset multiplot\n";
  return s;
}

}  // namespace palpate
