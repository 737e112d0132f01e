#include "viz/report/plot.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string_view>

#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "viz/report/gnuplot.h"

namespace palpate {
namespace {

std::string range_of(const char* axis, const PlotRange& range, bool down = false) {
  const auto end = [](double v) { return std::isfinite(v) ? plot_number(v) : std::string("*"); };
  const auto [from, to] = range.value_or(std::pair{kPlotAuto, kPlotAuto});
  // gnuplot reverses only what it ranges itself.
  const bool swapped = down && std::isfinite(from) && std::isfinite(to);
  if (!range && !down) return "";
  return std::string("set ") + axis + "range [" + end(swapped ? to : from) + ":" + end(swapped ? from : to) +
         "]" + (down && !swapped ? " reverse\n" : "\n");
}

/// Letters of the longest line of a key at the right of its panel, with its sample.
size_t letters_beside(const PlotPanel& panel) {
  size_t most = 0;
  if (!std::string_view(panel.key).starts_with("outside right")) return most;
  for (const PlotCurve& curve : panel.curves)
    if (!curve.title.empty()) most = std::max(most, curve.title.size() + 5);
  return most;
}

/// Whether names of tics would run into each other along an axis of that length.
bool are_crowded(const PlotTics& tics, const PlotRange& range, double width_px, bool logarithmic) {
  constexpr double kLetter_px = 10;
  const auto on_axis = [&](double value) { return logarithmic ? std::log(value) : value; };
  const auto place = [&](const auto& tic) { return on_axis(tic.second); };
  double low = place(std::ranges::min(tics, {}, place)), high = place(std::ranges::max(tics, {}, place));
  if (range && std::isfinite(range->first)) low = std::min(low, on_axis(range->first));
  if (range && std::isfinite(range->second)) high = std::max(high, on_axis(range->second));
  const double px_per_unit = width_px / std::max(high - low, 1e-300);
  for (size_t i = 1; i < tics.size(); ++i) {
    const double letters = static_cast<double>(tics[i - 1].first.size() + tics[i].first.size()) / 2 + 1;
    if (letters * kLetter_px > std::abs(place(tics[i]) - place(tics[i - 1])) * px_per_unit) return true;
  }
  return false;
}

std::string tics_of(const char* axis, const PlotTics& tics, const PlotRange& range, double width_px,
                    bool logarithmic) {
  if (tics.empty()) return "";
  const bool words =
      std::ranges::any_of(tics, [](const auto& tic) { return tic.first.find(' ') != std::string::npos; });
  // Crowded names take a line for each word, or are slanted.
  constexpr size_t kLongestBeside = 22;  // letters of a line beside the panel
  const bool upright = axis[0] == 'y', crowded = !upright && are_crowded(tics, range, width_px, logarithmic);
  std::string list;
  for (const auto& [whole, place] : tics) {
    // gnuplot takes a tic's name for a format.
    std::string name;
    for (const char c : whole) name += c == '%' ? std::string("%%") : std::string(1, c);
    list +=
        (list.empty() ? "" : ", ") +
        (upright || (crowded && words) ? plot_lines(name, upright ? kLongestBeside : 1) : plot_words(name)) +
        " " + plot_number(place);
  }
  return std::string("set ") + axis + "tics " + (crowded && !words ? "rotate by 40 right " : "") + "(" +
         list + ")" + (crowded && words ? " font ',9'\nset bmargin 6\nset xlabel offset 0,-1.5\n" : "\n");
}

std::string words_block(const std::string& name, const PlotCurve& curve) {
  std::string block = "$" + name + " << EOD\n";
  for (size_t i = 0; i < curve.x.size(); ++i)
    block += plot_number(curve.x[i]) + " " + plot_number(curve.y[i]) + " \"" + curve.words[i] + "\"\n";
  return block + "EOD\n";
}

/// What draws the curve: after an interval's band the curve itself.
std::string curve_lines(const PlotCurve& curve, const std::string& block, bool map) {
  using Style = PlotCurve::Style;
  const std::string colour = std::string(" lc rgb '") + plot_colour(curve.colour) + "'",
                    line = palpate::text(" lw %g", curve.width) + (curve.dashed ? " dt 2" : "") + colour,
                    points = palpate::text(" pt %d ps %g", curve.second_axis ? 6 : curve.mark, curve.size);
  const std::string title = curve.title.empty() ? " notitle" : " title " + plot_words(curve.title);
  const std::string data = "$" + block + " using ", axes = curve.second_axis ? " axes x1y2" : "",
                    place = curve.z.empty() ? "1:2" : "1:2:3";
  const bool interval = !curve.low.empty();
  const std::string bars = data + "1:2:3:4" + axes + (curve.across ? " with xerrorbars" : " with yerrorbars");
  const std::string band =
      data + "1:3:4" + axes + " with filledcurves fs transparent solid 0.2 noborder" + colour;
  const std::string half = palpate::text("%g", curve.width / 2);
  switch (curve.style) {
    case Style::Lines:
      return (interval ? band + " notitle, " : "") + data + place + axes + " with lines" + line + title;
    case Style::Points:
      return (interval ? bars : data + place + axes + " with points") + points +
             palpate::text(" lw %g", curve.mark == 7 ? 1 : curve.width) + colour + title;
    case Style::LinesAndPoints:
      return (interval ? bars + points + " lw 1" + colour + " notitle, " : "") + data + place + axes +
             " with linespoints" + points + line + title;
    case Style::Steps:
      return data + place + axes + " with steps" + line + title;
    case Style::FilledSteps:
      return data + place + " with fillsteps fs transparent solid 0.25" + colour + " notitle, " + data +
             place + " with steps" + line + title;
    case Style::Band:
      return band + title;
    case Style::Bars:
      return data + "1:2:($1-" + half + "):($1+" + half + "):(0):2 with boxxyerror fs solid 0.8 noborder" +
             colour + title;
    case Style::Rows:
      return data + "1:2:(0):1:($2-" + half + "):($2+" + half + ") with boxxyerror fs solid 0.8 noborder" +
             colour + title;
    case Style::Arrows:
      return data + "1:2:3:4 with vectors filled head size screen 0.008,20" + line + title;
    case Style::Words: {
      const std::string align = curve.align ? curve.align : map ? "center" : "left offset 0.7,0";
      return data + "1:2:3 with labels " + align + palpate::text(" font ',%g'", 18 * curve.size) +
             " tc rgb '" + plot_colour(curve.colour) + "' notitle";
    }
  }
  return "";
}

/// Least and largest of what is known.
std::pair<double, double> ends_of(const std::vector<double>& values) {
  std::pair<double, double> ends{HUGE_VAL, -HUGE_VAL};
  for (const double v : values)
    if (std::isfinite(v)) ends = {std::min(ends.first, v), std::max(ends.second, v)};
  return ends;
}

/// From border to border along x.
PlotRange cells_of(const PlotMap& map) {
  const double half = map.columns * map.pitch_x / 2;
  return {{map.x - half, map.x + half}};
}

/// Settings of a map; what draws it.
std::string map_of(const PlotMap& map, const std::string& name, std::string& blocks, std::string& drawn) {
  std::vector<std::vector<double>> columns(3);
  for (uint32_t j = 0; j < map.rows; ++j)
    for (uint32_t i = 0; i < map.columns; ++i) {
      columns[0].push_back(map.x + (i - (map.columns - 1) / 2.0) * map.pitch_x);
      columns[1].push_back(map.y + (j - (map.rows - 1) / 2.0) * map.pitch_y);
      columns[2].push_back(map.values[size_t{j} * map.columns + i]);
    }
  blocks += plot_block(name, columns);
  const auto [least, most] = ends_of(map.values);
  PlotRange range = map.range;
  if (map.signs && !range) {
    const double larger = std::max(std::abs(least), std::abs(most));
    range = larger > 0 && std::isfinite(larger) ? std::pair{-larger, larger} : std::pair{-1.0, 1.0};
  }
  drawn = "plot $" + name + " using 1:2:3 with image notitle";
  return "set tics out nomirror\nset cbtics in\nset autoscale fix\nset format cb '%.4g'\nset cblabel " +
         plot_words(map.label) +
         " offset 1.5,0\nset object 1 rectangle from graph 0,0 to graph 1,1 behind fc rgb '#70757d' fs solid "
         "noborder\n" +
         (map.signs ? "set palette defined (-1 '#2166ac', 0 '#f7f7f7', 1 '#b2182b')\n" : plot_palette()) +
         range_of("cb", range) + (map.range ? "" : plot_colour_bar(least, most));
}

/// Blocks of data, and the lines that draw the panel.
std::string panel_of(const PlotPanel& panel, const std::string& name, double width_px, std::string& blocks) {
  std::string lines = "reset\n", drawn;
  const bool space = std::any_of(panel.curves.begin(), panel.curves.end(),
                                 [](const PlotCurve& curve) { return !curve.z.empty(); });
  constexpr double kLetter_px = 9;
  const double beside_px = kLetter_px * static_cast<double>(letters_beside(panel));
  constexpr double kLabels_px = 100;  // at the left
  const double axis_px = width_px - beside_px - kLabels_px;
  // A title is centred above the axes, which a bar of colours moves to the left.
  const double title_px = width_px - beside_px - (panel.map ? kLabels_px / 2 : 0);
  lines += "set title " + plot_lines(panel.title, static_cast<size_t>(title_px / kLetter_px)) +
           "\nset xlabel " + plot_words(panel.x_label) + "\nset ylabel " + plot_words(panel.y_label) + "\n";
  lines += panel.map ? map_of(*panel.map, name, blocks, drawn) : std::string(plot_look());
  if (panel.log_x) lines += "set logscale x\nset format x '%g'\n";
  if (panel.log_y) lines += "set logscale y\nset format y '%g'\n";
  if (panel.equal || (panel.map && panel.x_tics.empty()))
    lines += space ? "set view equal xyz\n" : "set size ratio -1\n";
  if (space)
    lines +=
        "set view 55,35\nset tics font ',8'\nset xtics offset 0,-0.4\nset ytics offset 0.6,-0.2\nset xyplane "
        "0\nset zlabel " +
        plot_words(panel.z_label) + " rotate parallel\n" + range_of("z", {}, panel.down);
  lines += range_of("x", panel.x_range) + range_of("y", panel.y_range, panel.down && !space) +
           (panel.map ? tics_of("x", panel.x_tics, cells_of(*panel.map), axis_px - kLabels_px, false)
                      : tics_of("x", panel.x_tics, panel.x_range, axis_px, panel.log_x)) +
           tics_of("y", panel.y_tics, panel.y_range, axis_px, panel.log_y);
  if (!panel.map)
    lines += palpate::text("set offsets 0, graph %g, graph %g, 0\n", panel.room_right, panel.room_above);
  lines += std::string("set key on ") + panel.key + " samplen 2" +
           (panel.map ? " textcolor rgb '#ffffff'\n" : "\n");
  if (panel.bare)
    lines +=
        "unset tics\nunset border\nunset grid\nset lmargin 0\nset rmargin 0\nset tmargin 0\nset bmargin 0\n" +
        range_of("x", panel.x_range.value_or(std::pair{0.0, 1.0})) +
        range_of("y", panel.y_range.value_or(std::pair{0.0, 1.0}));
  if (!panel.picture.empty()) {
    lines += "unset tics\nset size ratio -1\n";
    drawn = "plot " + gnuplot_quoted(panel.picture) + " binary filetype=png with rgbimage notitle";
  }
  if (!panel.second_label.empty() && !panel.curves.empty())
    // Each label has the colour of what is drawn against it.
    lines += "set ytics nomirror\nset y2tics\n" + range_of("y2", panel.second_range) +
             palpate::text("set ylabel textcolor rgb '%s'\n", plot_colour(panel.curves.front().colour)) +
             "set y2label " + plot_words(panel.second_label) +
             palpate::text(" textcolor rgb '%s'\n", plot_colour(panel.curves.back().colour));
  for (size_t i = 0; i < panel.curves.size(); ++i) {
    const PlotCurve& curve = panel.curves[i];
    if (curve.x.empty()) continue;
    const std::string block = name + "_" + std::to_string(i);
    std::vector<std::vector<double>> columns = {curve.x, curve.y};
    for (const std::vector<double>* more : {&curve.z, &curve.low, &curve.high})
      if (!more->empty()) columns.push_back(*more);
    blocks += curve.words.empty() ? plot_block(block, columns) : words_block(block, curve);
    drawn += (!drawn.empty() ? ", "
              : space        ? "splot "
                             : "plot ") +
             curve_lines(curve, block, panel.map.has_value());
  }
  // gnuplot gives up where it finds no range.
  if (drawn.empty())
    drawn = std::string(panel.x_range ? "" : "set xrange [1:10]\n") + "set yrange [1:10]\nplot NaN notitle";
  return lines + drawn + "\n";
}

}  // namespace

std::vector<double> plot_scaled(std::vector<double> column, double factor) {
  for (double& value : column) value *= factor;
  return column;
}

std::array<std::vector<double>, 2> plot_ellipse(double x, double y, double width, double height) {
  std::array<std::vector<double>, 2> columns;
  for (int i = 0; i <= 72; ++i) {
    columns[0].push_back(x + width / 2 * std::cos(i * std::numbers::pi / 36));
    columns[1].push_back(y + height / 2 * std::sin(i * std::numbers::pi / 36));
  }
  return columns;
}

PlotCurve& PlotPanel::add(std::string name, std::vector<double> x, std::vector<double> y, size_t colour,
                          PlotCurve::Style style) {
  return curves.emplace_back(PlotCurve{std::move(name), std::move(x), std::move(y), style, colour});
}

PlotCurve& PlotPanel::add_line(std::string name, std::pair<double, double> from,
                               std::pair<double, double> to) {
  PlotCurve& line = add(std::move(name), {from.first, to.first}, {from.second, to.second}, kPlotGray);
  line.dashed = true;
  line.width = 1;
  return line;
}

std::string plot_script(const Plot& plot, PlotKind kind, const std::string& name) {
  std::string blocks, lines;
  const auto panels = static_cast<uint32_t>(plot.panels.size());
  // Panels that stand on each other have one left and one right edge.
  bool stacked = plot.across == 1 && panels > 1;
  size_t right = 4;
  for (const PlotPanel& panel : plot.panels) {
    stacked = stacked && panel.second_label.empty() && !panel.map;
    right = std::max(right, letters_beside(panel));
  }
  for (size_t i = 0; i < panels; ++i) {
    std::string panel = panel_of(plot.panels[i], "p" + std::to_string(i),
                                 static_cast<double>(plot.width_px) / plot.across, blocks);
    if (stacked)
      panel.insert(panel.find('\n') + 1, palpate::text("set lmargin 11\nset rmargin %zu\n", right));
    lines += panel;
  }
  const std::string layout =
      palpate::text("set multiplot layout %u,%u", (panels + plot.across - 1) / plot.across, plot.across) +
      (plot.title.empty() ? "" : " title " + plot_lines(plot.title, static_cast<size_t>(plot.width_px) / 9)) +
      "\n";
  return plot_terminal(kind, plot.width_px, plot.height_px, name) + blocks + layout + lines +
         "unset multiplot\n";
}

void draw_plot(const Plot& plot, const std::filesystem::path& stem, std::string& written) {
  for (const auto& [kind, ending] :
       {std::pair{PlotKind::Png, ".png"}, {PlotKind::Svg, ".svg"}, {PlotKind::Pdf, ".pdf"}}) {
    const std::string file = stem.string() + ending;
    const Picture picture = run_gnuplot(plot_script(plot, kind, stem.filename().string()));
    if (picture.bytes.empty()) {
      spdlog::warn("no plot {}: {}", file, picture.error);
      continue;
    }
    write_whole(file, std::string_view(picture.bytes));
    written += ", " + file;
  }
}

}  // namespace palpate
