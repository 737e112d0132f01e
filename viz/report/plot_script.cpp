#include "viz/report/plot_script.h"

#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <string_view>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "engine/base/text.h"
#include "viz/report/gnuplot.h"

namespace palpate {

std::string plot_head(bool svg, int width_px, int height_px) {
  return std::string("set terminal ") + (svg ? "svg" : "pngcairo") + " size " + std::to_string(width_px) +
         "," + std::to_string(height_px) +
         " noenhanced font 'DejaVu Sans,11'\n"
         "set grid lc rgb '#dddddd' lt 1 lw 0.6\nset border lc rgb '#666666'\n"
         "set tics textcolor rgb '#222222'\n";
}

std::string plot_number(double value) {
  if (!std::isfinite(value)) return "NaN";
  const std::string line = palpate::text("%.7g", value);
  return line;
}

std::string plot_block(const std::string& name, const std::vector<std::vector<double>>& columns) {
  std::string text = "$" + name + " << EOD\n";
  for (size_t row = 0; !columns.empty() && row < columns.front().size(); ++row) {
    for (const auto& column : columns) text += plot_number(column[row]) + " ";
    text += "\n";
  }
  return text + "EOD\n";
}

const char* plot_colour(size_t index) {
  constexpr const char* kColours[] = {"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                      "#555555", "#56b4e9", "#e69f00", "#8f3f00"};
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

void draw_plot(const std::string& script, const std::string& file, std::string& written) {
  const Picture picture = run_gnuplot(script);
  if (picture.bytes.empty()) {
    spdlog::warn("no plot {}: {}", file, picture.error);
    return;
  }
  write_whole(file, std::string_view(picture.bytes));
  written += ", " + file;
}

}  // namespace palpate
