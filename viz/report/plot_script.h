// Pieces of gnuplot scripts for the design commands: one style, data inside the script.
#pragma once

#include <string>
#include <vector>

namespace palpate {

/// Sets the picture's kind and size, grid, border and fonts.
std::string plot_head(bool svg, int width_px, int height_px);
/// Seven digits; "NaN" leaves a gap.
std::string plot_number(double value);
/// A named block of columns of equal length.
std::string plot_block(const std::string& name, const std::vector<std::vector<double>>& columns);
/// Colours that stay apart, also to colour-blind eyes and in print; cyclic.
const char* plot_colour(size_t index);

/// Runs gnuplot and writes what it draws; adds ", FILE" to `written`, or warns.
void draw_plot(const std::string& script, const std::string& file, std::string& written);

/// The same columns as CSV with a header line; NaN is an empty cell.
std::string csv_of(const std::string& header, const std::vector<std::vector<double>>& columns);

}  // namespace palpate
