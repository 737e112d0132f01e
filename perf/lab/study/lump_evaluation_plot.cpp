#include "perf/lab/study/lump_evaluation_plot.h"

#include <algorithm>
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "perf/lab/dataset/sweep.h"
#include "viz/report/plot.h"

namespace palpate {
namespace {

struct Axis {
  const char* name;
  const char* title;
  bool logarithmic;
};
constexpr std::array<Axis, 3> kAxes = {Axis{"size", "size, mm", false}, Axis{"depth", "depth, mm", false},
                                       Axis{"ratio", "stiffness ratio", true}};

std::string table(const std::vector<lump::Judged>& judged) {
  std::string csv =
      "block,lump,shape,size_mm,depth_mm,stiffness_ratio,x_mm,y_mm,thickness_mm,young_Pa,verdict,evidence,"
      "size_"
      "estimate_mm,size_low_mm,"
      "size_high_mm,depth_estimate_mm,depth_low_mm,depth_high_mm,ratio_estimate,ratio_low,ratio_high,x_"
      "estimate_mm,x_low_mm,x_high_mm,y_estimate_mm,y_low_mm,y_high_mm,"
      "shape_estimate,shape_probability,wall_ms\n";
  for (const lump::Judged& j : judged) {
    const auto cell = [&csv](double v, bool there = true) {
      csv += (there && std::isfinite(v) ? plot_number(v) : std::string()) + ",";
    };
    const bool lump = j.truth.lump;
    const lump::Estimate& e = j.estimate;
    csv += std::to_string(j.number) + ",";
    csv += lump ? std::string("1,") + to_string(j.truth.shape) + "," : "0,,";
    for (const double v : truth_of(j.truth)) cell(v, lump);
    for (const double offset : j.truth.offset_mm) cell(offset, lump);
    cell(j.truth.block_mm[2]);
    cell(j.truth.young_Pa);
    csv += std::string(to_string(e.verdict)) + ",";
    cell(e.detection_statistic);
    const bool seen = e.detection_statistic >= 1;
    for (const lump::Value& v : values_of(e))
      for (const double part : {v.value, v.low, v.high}) cell(part, seen);
    for (const lump::Value& v : {e.x_mm, e.y_mm})
      for (const double part : {v.value, v.low, v.high}) cell(part, seen);
    csv += (seen ? to_string(e.shape) : "") + std::string(",");
    cell(e.shape_probability[static_cast<size_t>(e.shape)], seen);
    csv += plot_number(1e3 * e.wall_s) + "\n";
  }
  return csv;
}

Plot estimates_plot(const lump::Score& s, const std::vector<lump::Judged>& judged) {
  Plot plot{.across = 3, .width_px = 1320, .height_px = 460};
  for (size_t p = 0; p < 3; ++p) {
    PlotPanel panel{text("%s: median error %.1f %%, 90 %% intervals hold %.0f %%", kAxes[p].name,
                         100 * s.median[p], 100 * s.coverage[p]),
                    std::string("true ") + kAxes[p].title, std::string("estimated ") + kAxes[p].title};
    PlotCurve estimates{.style = PlotCurve::Style::Points, .size = 0.35};
    double most = 0;
    for (const lump::Judged& j : judged) {
      const lump::Value v = values_of(j.estimate)[p];
      if (!j.truth.lump || j.estimate.detection_statistic < 1 || !std::isfinite(v.value)) continue;
      estimates.add(truth_of(j.truth)[p], v.value, v.low, v.high);
      most = std::max(most, truth_of(j.truth)[p]);
    }
    panel.log_x = panel.log_y = kAxes[p].logarithmic;
    panel.x_range = panel.y_range = kAxes[p].logarithmic ? std::pair{1.0, 50.0} : std::pair{0.0, kPlotAuto};
    panel.curves.push_back(std::move(estimates));
    const double from = kAxes[p].logarithmic ? 1 : 0, to = kAxes[p].logarithmic ? 50 : most;
    panel.add("", {from, to}, {from, to}, 1);
    plot.panels.push_back(std::move(panel));
  }
  return plot;
}

Plot quality_plot(const lump::Score& s) {
  PlotPanel ratio{"median error by the true stiffness ratio", "true stiffness ratio", "median error, %"};
  ratio.key = "top left";
  ratio.x_range = {{-0.6, static_cast<double>(s.by_ratio.size()) - 0.4}};
  ratio.y_range = {{0, kPlotAuto}};
  for (size_t p = 0; p < 3; ++p) {
    PlotCurve& bars = ratio.add(kAxes[p].name, {}, {}, p, PlotCurve::Style::Bars);
    bars.width = 0.25;
    for (size_t r = 0; r < s.by_ratio.size(); ++r) {
      bars.add(static_cast<double>(r) + 0.27 * (static_cast<double>(p) - 1), 100 * s.by_ratio[r].median[p]);
    }
  }
  for (const lump::ErrorRange& range : s.by_ratio)
    ratio.x_tics.emplace_back(
        range.high < 1e8 ? text("%.0f-%.0f", range.low, range.high) : text("> %.0f", range.low),
        ratio.x_tics.size());
  PlotPanel detection{text("detection (d >= 6 mm, h <= 8 mm): %.1f %% at specificity %.1f %%",
                           100 * s.goal_sensitivity, 100 * s.specificity),
                      "false alarms, %", "lumps detected, %"};
  detection.x_range = {{0, 100}};
  detection.y_range = {{0, 101}};
  PlotCurve& roc = detection.add("", {}, {}, 0, PlotCurve::Style::Steps);
  for (const auto& point : s.roc) {
    roc.add(100 * point[0], 100 * point[1]);
  }
  detection.add_line("", {0, 0}, {100, 100});
  PlotPanel shapes{text("shape right in %.1f %%", 100 * s.shape_rate), "answer", "truth"};
  PlotMap map{.columns = 4, .rows = 4, .range = {{0, 100}}, .x = 1.5, .y = 1.5, .label = "% of the truth"};
  PlotCurve counts[2];  // on dark and on bright cells
  for (size_t a = 0; a < 4; ++a) {
    size_t sum = 0;
    for (const size_t n : s.shapes[a]) sum += n;
    shapes.x_tics.emplace_back(to_string(static_cast<InclusionShape>(a)), a);
    for (size_t b = 0; b < 4; ++b) {
      map.values.push_back(sum > 0 ? 100.0 * static_cast<double>(s.shapes[a][b]) / static_cast<double>(sum)
                                   : 0);
      PlotCurve& curve = counts[map.values.back() > 55];
      curve.add(static_cast<double>(b), static_cast<double>(a));
      curve.words.push_back(std::to_string(s.shapes[a][b]));
    }
  }
  for (PlotCurve& curve : counts) curve.style = PlotCurve::Style::Words;
  counts[0].colour = kPlotWhite;
  counts[1].colour = kPlotBlack;
  shapes.curves = {counts[0], counts[1]};
  shapes.y_tics = shapes.x_tics;
  shapes.map = map;
  shapes.down = true;
  return {.panels = {ratio, detection, shapes}, .across = 3, .width_px = 1320, .height_px = 460};
}

}  // namespace

std::string write_score(const lump::Score& score, const std::vector<lump::Judged>& judged,
                        const std::string& folder) {
  make_output_folder(folder);
  write_whole(folder + "/lump_evaluation.csv", std::string_view(table(judged)));
  std::string written = folder + "/lump_evaluation.csv";
  draw_plot(estimates_plot(score, judged), folder + "/estimates", written);
  draw_plot(quality_plot(score), folder + "/quality", written);
  return written;
}

}  // namespace palpate
