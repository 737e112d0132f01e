#include "perf/lab/study/lump_evaluation_plot.h"

#include <algorithm>
#include <cmath>

#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "perf/lab/dataset/sweep.h"
#include "viz/report/gnuplot.h"
#include "viz/report/plot_script.h"

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
      "estimate_mm,y_estimate_mm,"
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
    cell(e.x_mm.value, seen);
    cell(e.y_mm.value, seen);
    csv += (seen ? to_string(e.shape) : "") + std::string(",");
    cell(e.shape_probability[static_cast<size_t>(e.shape)], seen);
    csv += plot_number(1e3 * e.wall_s) + "\n";
  }
  return csv;
}

std::string estimates_script(const lump::Score& s, const std::vector<lump::Judged>& judged) {
  std::string script;
  for (size_t p = 0; p < 3; ++p) {
    std::vector<std::vector<double>> columns(4);
    for (const lump::Judged& j : judged) {
      const lump::Value v = values_of(j.estimate)[p];
      if (!j.truth.lump || j.estimate.detection_statistic < 1 || !std::isfinite(v.value)) continue;
      const std::array<double, 4> row = {truth_of(j.truth)[p], v.value, v.low, v.high};
      for (size_t c = 0; c < 4; ++c) columns[c].push_back(row[c]);
    }
    if (columns[0].empty())
      for (auto& column : columns) column.push_back(std::nan(""));
    script += plot_block(kAxes[p].name, columns);
  }
  script += "set multiplot layout 1,3\nset key off\n";
  for (size_t p = 0; p < 3; ++p) {
    std::string title = text("%s: median error %.1f %%, 90 %% intervals hold %.0f %%", kAxes[p].name,
                             100 * s.median[p], 100 * s.coverage[p]);
    script += std::string("set title ") + gnuplot_quoted(title) + "\nset xlabel 'true " + kAxes[p].title +
              "'\nset ylabel 'estimated " + kAxes[p].title + "'\n";
    script += kAxes[p].logarithmic ? "set logscale xy\nset xrange [1:50]\nset yrange [1:50]\n"
                                   : "unset logscale\nset xrange [0:*]\nset yrange [0:*]\n";
    script += std::string("plot $") + kAxes[p].name +
              " using 1:2:3:4 with yerrorbars pt 7 ps 0.35 lw 0.5 lc rgb '#7fb2d9', $" + kAxes[p].name +
              " using 1:2 with points pt 7 ps 0.35 lc rgb '#0072b2', x with lines lc rgb '#d55e00'\n";
  }
  return script + "unset multiplot\n";
}

std::string quality_script(const lump::Score& s) {
  std::vector<std::vector<double>> ratio(4), roc(2), shapes(3);
  std::string tics;
  for (size_t r = 0; r < s.by_ratio.size(); ++r) {
    const lump::ErrorRange& range = s.by_ratio[r];
    ratio[0].push_back(static_cast<double>(r));
    for (size_t p = 0; p < 3; ++p) ratio[p + 1].push_back(100 * range.median[p]);
    std::string tic;
    if (range.high < 1e8)
      tic = text("%s'%.0f-%.0f' %zu", r > 0 ? "," : "", range.low, range.high, r);
    else
      tic = text("%s'> %.0f' %zu", r > 0 ? "," : "", range.low, r);
    tics += tic;
  }
  for (const auto& point : s.roc) {
    roc[0].push_back(100 * point[0]);
    roc[1].push_back(100 * point[1]);
  }
  std::string labels;
  for (size_t a = 0; a < 4; ++a) {
    size_t sum = 0;
    for (const size_t n : s.shapes[a]) sum += n;
    for (size_t b = 0; b < 4; ++b) {
      const double fraction =
          sum > 0 ? 100.0 * static_cast<double>(s.shapes[a][b]) / static_cast<double>(sum) : 0;
      shapes[0].push_back(static_cast<double>(b));
      shapes[1].push_back(static_cast<double>(a));
      shapes[2].push_back(fraction);
      std::string label = text("set label '%zu' at %zu,%zu center front tc rgb '%s'\n", s.shapes[a][b], b, a,
                               fraction > 55 ? "#000000" : "#ffffff");
      labels += label;
    }
  }
  std::string script = plot_block("ratio", ratio) + plot_block("roc", roc) + plot_block("shapes", shapes);
  script +=
      "set multiplot layout 1,3\nset title 'median error by the true stiffness ratio'\nset xlabel 'true "
      "stiffness ratio'\nset ylabel 'median error, %'\n"
      "set xtics (" +
      tics +
      ")\nset xrange [-0.6:4.6]\nset yrange [0:*]\nset key top left\nset style fill solid 0.9\nset boxwidth "
      "0.25\n";
  for (size_t p = 0; p < 3; ++p) {
    script += p == 0 ? "plot " : ", ";
    script += "$ratio using ($1+" + plot_number(0.27 * (static_cast<double>(p) - 1)) +
              "):" + std::to_string(p + 2) + " with boxes lc rgb '" + plot_colour(p) + "' title '" +
              kAxes[p].name + "'";
  }
  std::string title = text("detection (d >= 6 mm, h <= 8 mm): %.1f %% at specificity %.1f %%",
                           100 * s.goal_sensitivity, 100 * s.specificity);
  script += std::string("\nset key off\nset xtics auto\nset xrange [0:100]\nset yrange [0:101]\nset title ") +
            gnuplot_quoted(title) +
            "\nset xlabel 'false alarms, %'\nset ylabel 'lumps detected, %'\nplot $roc with steps lw 2 lc "
            "rgb '#0072b2', x with lines dt 2 lc rgb '#888888'\n";
  title = text("shape right in %.1f %%", 100 * s.shape_rate);
  std::string names;
  for (size_t i = 0; i < 4; ++i)
    names += std::string(i > 0 ? "," : "") + "'" + to_string(static_cast<InclusionShape>(i)) + "' " +
             std::to_string(i);
  script += std::string("set title ") + gnuplot_quoted(title) +
            "\nset xlabel 'answer'\nset ylabel 'truth'\nset xtics (" + names +
            ") rotate by 30 right\nset ytics (" + names +
            ")\nset xrange [-0.5:3.5]\nset yrange [3.5:-0.5]\nunset grid\nset cbrange [0:100]\nset cblabel "
            "'% of the truth'\n" +
            plot_palette() + labels + "plot $shapes using 1:2:3 with image\nunset multiplot\n";
  return script;
}

}  // namespace

std::string write_score(const lump::Score& score, const std::vector<lump::Judged>& judged,
                        const std::string& folder) {
  make_output_folder(folder);
  write_whole(folder + "/lump_evaluation.csv", std::string_view(table(judged)));
  std::string written = folder + "/lump_evaluation.csv";
  const std::array<std::pair<const char*, std::string>, 2> pictures = {
      std::pair{"estimates", estimates_script(score, judged)}, std::pair{"quality", quality_script(score)}};
  for (const auto& picture : pictures)
    draw_plots([&](PlotKind kind) { return plot_head(kind, 1320, 460) + picture.second; },
               folder + "/" + picture.first, written);
  return written;
}

}  // namespace palpate
