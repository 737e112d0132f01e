// Pieces of gnuplot scripts for the design commands: one style, data inside the script.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace palpate {

enum class PlotKind { Png, Svg, Pdf };

/// Sets the picture's kind and size; Unicode for superscripts, since nothing is read as markup. `name` keeps
/// SVGs in one page apart.
std::string plot_terminal(PlotKind kind, int width_px, int height_px, const std::string& name = "plot");
/// Grid, border and tics as all plots have them.
const char* plot_look();
/// Terminal and look.
std::string plot_head(PlotKind kind, int width_px, int height_px);
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
  /// `column` of a data block in this unit, for "using".
  std::string column(int number) const;
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

/// Runs gnuplot and writes what it draws; adds ", FILE" to `written`, or warns.
void draw_plot(const std::string& script, const std::string& file, std::string& written);

/// Draws the script of each kind to STEM.png, STEM.svg and STEM.pdf; adds their names to `written`, or warns.
void draw_plots(const std::function<std::string(PlotKind)>& script, const std::filesystem::path& stem,
                std::string& written);

/// The same of a script without a terminal of its own, of one size.
void draw_scripts(const std::string& script, int width_px, int height_px, const std::filesystem::path& stem,
                  std::string& written);
/// A named block of lines as they are; without any, one that draws nothing.
std::string data_block(const std::string& name, const std::string& lines);

/// The same columns as CSV with a header line; NaN is an empty cell.
std::string csv_of(const std::string& header, const std::vector<std::vector<double>>& columns);

}  // namespace palpate
