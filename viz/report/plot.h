// A plot as data: curves and maps with a short description, drawn by one function.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "viz/report/plot_script.h"

namespace palpate {

/// An end of a range that the data set.
constexpr double kPlotAuto = std::numeric_limits<double>::quiet_NaN();
using PlotRange = std::optional<std::pair<double, double>>;
/// Names at places of an axis.
using PlotTics = std::vector<std::pair<std::string, double>>;

/// One curve: columns of equal length, NaN leaves a gap.
struct PlotCurve {
  enum class Style : uint8_t {
    Lines,
    Points,
    LinesAndPoints,
    Steps,
    FilledSteps,
    Band,    ///< between `low` and `high`
    Bars,    ///< from 0 up to y, `width` wide on the axis
    Rows,    ///< from 0 along to x, `width` high on the axis
    Arrows,  ///< from x, y by `low` along x and by `high` along y
    Words,
  };

  std::string title = {};  ///< in the key; empty: not there
  std::vector<double> x = {}, y = {};
  Style style = Style::Lines;
  size_t colour = 0;  ///< of plot_colour()
  bool dashed = false;
  double width = 2;          ///< of lines, px
  bool second_axis = false;  ///< drawn against the axis on the right
  /// Interval of each y: a band around lines, else bars.
  std::vector<double> low = {}, high = {};
  bool across = false;                  ///< the interval is that of x
  std::vector<double> z = {};           ///< a point in space; all curves of a panel or none
  int mark = 7;                         ///< gnuplot's kind of point
  double size = 0.5;                    ///< of points and of letters
  std::vector<std::string> words = {};  ///< of Style::Words
  const char* align = nullptr;          ///< left, center, right; none: center on a map, else right of a point

  void add(double at_x, double at_y) {
    x.push_back(at_x);
    y.push_back(at_y);
  }
  /// A point with its interval, or an arrow.
  void add(double at_x, double at_y, double from, double to) {
    add(at_x, at_y);
    low.push_back(from);
    high.push_back(to);
  }
};

/// Values over a grid, as colours: rows from the lowest y up; NaN is gray.
struct PlotMap {
  uint32_t columns = 0, rows = 0;
  double pitch_x = 1, pitch_y = 1;
  std::vector<double> values = {};  ///< row by row
  PlotRange range = {};             ///< of the colours; none: that of the values
  double x = 0, y = 0;              ///< the grid's middle
  std::string label = {};           ///< of the colours
  bool signs = false;               ///< colours of both signs about 0
};

/// One pair of axes: a map, and curves over it.
struct PlotPanel {
  std::string title = {}, x_label = {}, y_label = {};
  std::string second_label = {};  ///< of the axis on the right, for the last curve; empty: there is none
  std::vector<PlotCurve> curves = {};
  std::optional<PlotMap> map = {};
  bool log_x = false, log_y = false;
  PlotRange x_range = {}, second_range = {};
  PlotTics x_tics = {};           ///< empty: where gnuplot puts them; slanted where they need the room
  const char* key = "top right";  ///< place of the key
  double room_above = 0;          ///< for the key, as a fraction of the height
  double room_right = 0;          ///< for words
  PlotRange y_range = {};
  PlotTics y_tics = {};
  std::string z_label = {};  ///< of points in space
  bool down = false;         ///< y grows downwards; in space z
  bool equal = false;        ///< one scale for all axes, as maps have it
  bool bare = false;         ///< without axes and margins, from 0 to 1 unless ranges say otherwise
  std::string picture = {};  ///< a PNG file in place of all else

  PlotCurve& add(std::string name, std::vector<double> x, std::vector<double> y, size_t colour = 0,
                 PlotCurve::Style style = PlotCurve::Style::Lines);
  /// A thin dashed line between two points.
  PlotCurve& add_line(std::string name, std::pair<double, double> from, std::pair<double, double> to);
};

struct Plot {
  std::string title = {};
  std::vector<PlotPanel> panels = {};
  uint32_t across = 1;  ///< panels next to each other
  int width_px = 820, height_px = 520;
};

/// A column times a factor.
std::vector<double> plot_scaled(std::vector<double> column, double factor);
/// x and y of an ellipse along the axes.
std::array<std::vector<double>, 2> plot_ellipse(double x, double y, double width, double height);

/// The script that draws it, with its data; `name` keeps SVGs in one page apart.
std::string plot_script(const Plot& plot, PlotKind kind, const std::string& name = "plot");
/// Draws STEM.png, STEM.svg and STEM.pdf; adds their names to `written`, or warns.
void draw_plot(const Plot& plot, const std::filesystem::path& stem, std::string& written);

}  // namespace palpate
