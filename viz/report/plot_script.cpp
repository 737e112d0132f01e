#include "viz/report/plot_script.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "capture/files/measurements.h"
#include "engine/base/text.h"
#include "viz/report/gnuplot.h"

namespace palpate {

std::string plot_terminal(PlotKind kind, int width_px, int height_px, const std::string& name) {
  constexpr double kDots = 96;  // in an inch
  std::string line = "set terminal ";
  if (kind == PlotKind::Pdf)
    line += palpate::text("pdfcairo size %.3fin,%.3fin fontscale 0.75", width_px / kDots, height_px / kDots);
  else
    line += palpate::text("%s size %d,%d", kind == PlotKind::Svg ? "svg" : "pngcairo", width_px, height_px);
  line += " noenhanced font 'DejaVu Sans,13'";
  if (kind == PlotKind::Svg) {
    std::string id = name;
    std::replace(id.begin(), id.end(), '-', '_');
    line += " background rgb '#ffffff' name " + gnuplot_quoted(id);
  }
  return line + "\n";
}

const char* plot_look() {
  return "set grid lc rgb '#dddddd' lt 1 lw 0.6\nset border lc rgb '#666666'\nset tics textcolor rgb "
         "'#222222'\n";
}

std::string plot_number(double value) {
  if (!std::isfinite(value)) return "NaN";
  return palpate::text("%.7g", value);
}

std::string plot_block(const std::string& name, const std::vector<std::vector<double>>& columns) {
  std::string text = "$" + name + " << EOD\n";
  for (size_t row = 0; !columns.empty() && row < columns.front().size(); ++row) {
    for (const auto& column : columns) text += plot_number(column[row]) + " ";
    text += "\n";
  }
  return text + "EOD\n";
}

std::string plot_words(const std::string& words) {
  std::string raised = words;
  const auto replace = [&](const std::string& what, const std::string& by) {
    for (size_t at = raised.find(what); at != std::string::npos; at = raised.find(what, at + by.size()))
      raised.replace(at, what.size(), by);
  };
  replace("^2", "²");
  replace("^3", "³");
  replace(" mm2", " mm²");
  replace(" mm3", " mm³");
  return gnuplot_quoted(raised);
}

std::string plot_lines(const std::string& words, size_t most) {
  std::string script, line;
  const auto end_line = [&] {
    script += (script.empty() ? "" : ".\"\\n\".") + plot_words(line);
    line.clear();
  };
  for (size_t at = 0; at < words.size();) {
    const size_t space = std::min(words.find_first_of(" \n", at), words.size());
    const std::string word = words.substr(at, space - at);
    if ((at > 0 && words[at - 1] == '\n') || (!line.empty() && line.size() + 1 + word.size() > most))
      end_line();
    line += (line.empty() ? "" : " ") + word;
    at = space + 1;
  }
  end_line();
  return script;
}

PlotUnit plot_unit(double largest, const std::string& unit) {
  if (largest >= 1e6) return {1e-6, "M" + unit};
  if (largest >= 1e3) return {1e-3, "k" + unit};
  if (largest >= 1 || !(largest > 0)) return {1, unit};
  return largest >= 1e-3 ? PlotUnit{1e3, "m" + unit} : PlotUnit{1e6, "µ" + unit};
}

const char* plot_palette() {
  return "set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#fde725')\n";
}

std::string plot_colour_bar(double least, double most) {
  const bool constant = !(most - least > 1e-6 * std::max(std::abs(least), std::abs(most)));
  return constant ? "unset colorbox\n" : "set colorbox\n";
}

const char* plot_colour(size_t index) {
  constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                      "#555555", "#56b4e9", "#e69f00", "#8f3f00"};
  constexpr const char* kOthers[] = {"#000000", "#888888", "#ffffff", "#00e5ff", "#ff5a5f"};
  if (index >= kPlotBlack) return kOthers[(index - kPlotBlack) % std::size(kOthers)];
  return kColours[index % std::size(kColours)];
}

std::string csv_of(const std::string& header, const std::vector<std::vector<double>>& columns) {
  std::string text = header + "\n";
  for (size_t row = 0; !columns.empty() && row < columns.front().size(); ++row) {
    for (size_t c = 0; c < columns.size(); ++c)
      text += (c ? "," : "") + (std::isfinite(columns[c][row]) ? shortest(columns[c][row]) : std::string());
    text += "\n";
  }
  return text;
}

}  // namespace palpate
