// A plot as data: curves and maps with a short description, drawn by one function.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viz/report/plot_script.h"

namespace palpate {

/// One curve: columns of equal length, NaN leaves a gap.
struct PlotCurve {
  enum class Style : uint8_t { Lines, Points, LinesAndPoints };

  std::string title = {};  ///< in the key; empty: not there
  std::vector<double> x = {}, y = {};
  Style style = Style::Lines;
  size_t colour = 0;  ///< of plot_colour()
  bool dashed = false;
  double width = 2;          ///< of lines, px
  bool second_axis = false;  ///< drawn against the axis on the right
};

/// Values over a grid, as colours: rows from the lowest y up, the grid's middle at 0, 0.
struct PlotMap {
  uint32_t columns = 0, rows = 0;
  double pitch_x = 1, pitch_y = 1;
  std::vector<double> values = {};                      ///< row by row
  std::optional<std::pair<double, double>> range = {};  ///< of the colours; none: that of the values
};

/// One pair of axes: curves, or a map.
struct PlotPanel {
  std::string title = {}, x_label = {}, y_label = {};
  std::string second_label = {};  ///< of the axis on the right, for the last curve; empty: there is none
  std::vector<PlotCurve> curves = {};
  std::optional<PlotMap> map = {};
  bool log_x = false, log_y = false;
  std::optional<std::pair<double, double>> x_range = {}, second_range = {};
  std::vector<std::pair<std::string, double>> x_tics = {};  ///< empty: where gnuplot puts them
  const char* key = "top right";                            ///< place of the key
  double room_above = 0;                                    ///< for the key, as a fraction of the height
};

struct Plot {
  std::string title = {};
  std::vector<PlotPanel> panels = {};
  uint32_t across = 1;  ///< panels beside each other
  int width_px = 820, height_px = 520;
};

/// A column times a factor.
std::vector<double> plot_scaled(std::vector<double> column, double factor);

/// The script that draws it, with its data.
std::string plot_script(const Plot& plot, PlotKind kind);
/// Draws STEM.png, STEM.svg and STEM.pdf; adds their names to `written`, or warns.
void draw_plot(const Plot& plot, const std::filesystem::path& stem, std::string& written);

}  // namespace palpate
