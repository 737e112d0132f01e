#include "viz/report/plot.h"

#include <algorithm>
#include <cmath>

#include "engine/base/text.h"

namespace palpate {
namespace {

/// Resets the settings of the panel before.
constexpr const char* kAfresh =
    "unset logscale\nset autoscale\nset size noratio\nset xtics auto\nset ytics mirror\nunset y2tics\n"
    "unset y2label\nset offsets 0, 0, 0, 0\nset ylabel textcolor default\n";

std::string range_of(const char* axis, const std::optional<std::pair<double, double>>& range) {
  return range ? palpate::text("set %srange [%.7g:%.7g]\n", axis, range->first, range->second) : "";
}

std::string tics_of(const std::vector<std::pair<std::string, double>>& tics) {
  if (tics.empty()) return "";
  std::string list;
  for (const auto& [name, place] : tics)
    list += (list.empty() ? "" : ", ") + plot_words(name) + " " + plot_number(place);
  return "set xtics (" + list + ")\n";
}

std::string curve_line(const PlotCurve& curve, const std::string& block) {
  std::string line = "$" + block + (curve.second_axis ? " axes x1y2" : "");
  switch (curve.style) {
    case PlotCurve::Style::Lines:
      line += palpate::text(" with lines lw %g", curve.width);
      break;
    case PlotCurve::Style::Points:
      line += " with points pt 7 ps 0.5";
      break;
    case PlotCurve::Style::LinesAndPoints:
      line += palpate::text(" with linespoints pt %d ps 0.6 lw %g", curve.second_axis ? 6 : 7, curve.width);
      break;
  }
  if (curve.dashed) line += " dt 2";
  line += std::string(" lc rgb '") + plot_colour(curve.colour) + "'";
  return line + (curve.title.empty() ? " notitle" : " title " + plot_words(curve.title));
}

/// Blocks of data, and the lines that draw the panel.
std::string curves_of(const PlotPanel& panel, const std::string& name, std::string& blocks) {
  std::string lines = plot_look();
  if (panel.log_x) lines += "set logscale x\n";
  if (panel.log_y) lines += "set logscale y\n";
  lines += range_of("x", panel.x_range) + tics_of(panel.x_tics) +
           palpate::text("set offsets graph 0, 0, graph %g, 0\nset key on %s samplen 1\n", panel.room_above,
                         panel.key);
  if (!panel.second_label.empty() && !panel.curves.empty())
    // Each label has the colour of what is drawn against it.
    lines += "set ytics nomirror\nset y2tics\n" + range_of("y2", panel.second_range) +
             palpate::text("set ylabel textcolor rgb '%s'\n", plot_colour(panel.curves.front().colour)) +
             "set y2label " + plot_words(panel.second_label) +
             palpate::text(" textcolor rgb '%s'\n", plot_colour(panel.curves.back().colour));
  std::string drawn;
  for (size_t i = 0; i < panel.curves.size(); ++i) {
    const PlotCurve& curve = panel.curves[i];
    if (curve.x.empty()) continue;
    const std::string block = name + "_" + std::to_string(i);
    blocks += plot_block(block, {curve.x, curve.y});
    drawn += (drawn.empty() ? "plot " : ", ") + curve_line(curve, block);
  }
  // gnuplot gives up where it finds no range.
  if (drawn.empty()) drawn = "set xrange [1:10]\nset yrange [1:10]\nplot NaN notitle";
  return lines + drawn + "\n";
}

std::string map_of(const PlotMap& map, const std::string& name, std::string& blocks) {
  std::vector<std::vector<double>> columns(3);
  for (uint32_t j = 0; j < map.rows; ++j)
    for (uint32_t i = 0; i < map.columns; ++i) {
      columns[0].push_back((i - (map.columns - 1) / 2.0) * map.pitch_x);
      columns[1].push_back((j - (map.rows - 1) / 2.0) * map.pitch_y);
      columns[2].push_back(map.values[size_t{j} * map.columns + i]);
    }
  blocks += plot_block(name, columns);
  const auto [least, most] = std::minmax_element(map.values.begin(), map.values.end());
  return std::string(
             "unset key\nset size ratio -1\nset tics out\nset autoscale fix\nset format cb '%.4g'\n") +
         plot_palette() + range_of("cb", map.range) + plot_colour_bar(*least, *most) + "plot $" + name +
         " using 1:2:3 with image\n";
}

}  // namespace

std::vector<double> plot_scaled(std::vector<double> column, double factor) {
  for (double& value : column) value *= factor;
  return column;
}

std::string plot_script(const Plot& plot, PlotKind kind) {
  std::string blocks, lines;
  for (size_t i = 0; i < plot.panels.size(); ++i) {
    const PlotPanel& panel = plot.panels[i];
    const std::string name = "p" + std::to_string(i);
    lines += kAfresh + ("set title " + plot_words(panel.title)) + "\nset xlabel " +
             plot_words(panel.x_label) + "\nset ylabel " + plot_words(panel.y_label) + "\n" +
             (panel.map ? map_of(*panel.map, name, blocks) : curves_of(panel, name, blocks));
  }
  const auto panels = static_cast<uint32_t>(plot.panels.size());
  const std::string layout =
      palpate::text("set multiplot layout %u,%u", (panels + plot.across - 1) / plot.across, plot.across) +
      (plot.title.empty() ? "" : " title " + plot_words(plot.title)) + "\n";
  return plot_terminal(kind, plot.width_px, plot.height_px) + blocks + layout + lines + "unset multiplot\n";
}

void draw_plot(const Plot& plot, const std::filesystem::path& stem, std::string& written) {
  draw_plots([&](PlotKind kind) { return plot_script(plot, kind); }, stem, written);
}

}  // namespace palpate
