#include "viz/report/match_plot.h"

#include <cstdio>
#include <limits>
#include <vector>

#include "engine/base/text.h"
#include "viz/report/gnuplot.h"
#include "viz/report/plot_script.h"

namespace palpate {
namespace {

std::vector<std::vector<double>> columns_of(const PointSet& set) {
  std::vector<std::vector<double>> columns(set.axes);
  for (size_t i = 0; i < set.size(); ++i)
    for (uint32_t c = 0; c < set.axes; ++c) columns[c].push_back(set.at(i)[c]);
  return columns;
}

// Left: the two sets and their correspondences; right: the template on the target.
std::string plot(PlotKind kind, const PointSet& from, const PointSet& to, const MatchResult& result) {
  constexpr double kGap = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::vector<double>> lines(from.axes);
  for (size_t i = 0; i < result.partners.size(); ++i) {
    if (!result.partners[i].target) continue;
    for (uint32_t c = 0; c < from.axes; ++c) {
      lines[c].push_back(from.at(i)[c]);
      lines[c].push_back(to.at(*result.partners[i].target)[c]);
      lines[c].push_back(kGap);
    }
  }
  const size_t pairs = lines[0].size() / 3;
  if (lines[0].empty())
    for (auto& column : lines) column.push_back(kGap);
  const bool flat = from.axes == 2;
  const std::string with = flat ? "plot " : "splot ", columns = flat ? " using 1:2 " : " using 1:2:3 ";
  const std::string title = text("%zu pairs; noise %.3g, evidence %.3g nats a point", pairs, result.noise_sd,
                                 result.log_likelihood_gain);
  std::string s = plot_head(kind, 1200, 620) + plot_block("from", columns_of(from)) +
                  plot_block("to", columns_of(to)) + plot_block("warped", columns_of(result.warped)) +
                  plot_block("lines", lines);
  s += "set multiplot layout 1,2\nset key outside bottom center horizontal\n";
  s += flat ? "set size ratio -1\nset xlabel 'x'\nset ylabel 'y'\n"
            : "set view equal xyz\nset xlabel 'x'\nset ylabel 'y'\nset zlabel 'z'\n";
  s += "set title " + gnuplot_quoted(std::string(to_string(result.verdict))) + "\n" + with + "$lines" +
       columns + "with lines lw 0.7 lc rgb '#aaaaaa' notitle, $to" + columns +
       "with points pt 7 ps 0.5 lc rgb '" + plot_colour(1) + "' title 'target', $from" + columns +
       "with points pt 6 ps 0.7 lc rgb '" + plot_colour(0) + "' title 'template'\n";
  s += "set title " + gnuplot_quoted(title) + "\n" + with + "$to" + columns +
       "with points pt 7 ps 0.5 lc rgb '" + plot_colour(1) + "' title 'target', $warped" + columns +
       "with points pt 6 ps 0.7 lc rgb '" + plot_colour(0) + "' title 'warped template'\nunset multiplot\n";
  return s;
}

}  // namespace

void draw_match(const std::filesystem::path& folder, const PointSet& from, const PointSet& to,
                const MatchResult& result, std::string& written) {
  draw_plots([&](PlotKind kind) { return plot(kind, from, to, result); }, folder / "match", written);
}

}  // namespace palpate
