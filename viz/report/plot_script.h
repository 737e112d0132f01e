// Pieces of the gnuplot scripts that plot.h makes: one style, data inside the script.
#pragma once

#include <string>
#include <vector>

namespace palpate {

enum class PlotKind { Png, Svg, Pdf };

/// Sets the picture's kind and size; Unicode for superscripts, since nothing is read as markup. `name` keeps
/// SVGs in one page apart.
std::string plot_terminal(PlotKind kind, int width_px, int height_px, const std::string& name = "plot");
/// Grid, border and tics as all plots have them.
const char* plot_look();
/// Seven digits; "NaN" leaves a gap.
std::string plot_number(double value);
/// A named block of columns of equal length.
std::string plot_block(const std::string& name, const std::vector<std::vector<double>>& columns);
/// A title or label in gnuplot's quotes, with superscripts for ^2 and ^3 and after a length (mm2).
std::string plot_words(const std::string& words);
/// The same in its lines and as many more as it takes, none longer than `most` letters unless one word is.
std::string plot_lines(const std::string& words, size_t most);

/// A unit with the SI prefix that keeps values up to `largest` below 1000.
struct PlotUnit {
  double factor = 1;  ///< of the values
  std::string name;
};
PlotUnit plot_unit(double largest, const std::string& unit);

/// The palette of maps, which rises evenly in lightness.
const char* plot_palette();
/// Colour bar of a map between `least` and `most`: none where all of it has one value.
std::string plot_colour_bar(double least, double most);

/// Colours that stay apart, also to colour-blind eyes and in print; cyclic. After them those of plain lines
/// and of lines over maps.
constexpr size_t kPlotBlack = 1000, kPlotGray = 1001, kPlotWhite = 1002, kPlotCyan = 1003, kPlotRed = 1004;
const char* plot_colour(size_t index);

/// Columns of equal length as CSV with a header line; NaN is an empty cell.
std::string csv_of(const std::string& header, const std::vector<std::vector<double>>& columns);

}  // namespace palpate
