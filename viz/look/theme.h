// Colours of the window, of reports and of pictures: each has one meaning, in a dark and in a light theme.
#pragma once

#include <cstdint>

namespace palpate::viz {

/// Red, green and blue, 0 to 255, as screens show them (sRGB).
struct Rgb {
  uint8_t red = 0, green = 0, blue = 0;
  bool operator==(const Rgb&) const = default;
};

/// Contrast of two colours, 1 to 21, by the Web Content Accessibility Guidelines 2.1. Small words need 4.5,
/// lines 3.
double contrast(Rgb a, Rgb b);

/// What a word or a mark means to whoever reads it.
enum class Meaning { Plain, Explains, Valid, Doubtful, Wrong, Slips, Chosen };
inline constexpr int kMeanings = 7;

/// Words in any of its colours can be read on any of its grounds.
struct Theme {
  Rgb ground;  ///< behind the surface, and of pages
  Rgb panel;   ///< behind numbers and settings
  Rgb chart;   ///< behind curves
  Rgb field;   ///< of what can be pressed, chosen or written in
  Rgb picked;  ///< of what is pressed, or chosen in a list

  Rgb grid, frame;  ///< lines within a chart, and around it
  Rgb text;         ///< what was measured
  Rgb faint;        ///< what explains it, or is not known
  Rgb valid, doubtful, wrong, slips;
  Rgb chosen;         ///< what is selected or done; first curve
  Rgb second, third;  ///< further curves
  Rgb depth, limit;   ///< curve of the depth; limits of a calibration

  Rgb of(Meaning meaning) const;
};

const Theme& dark_theme();
const Theme& light_theme();
/// The one in use, of this thread's window; dark until another is chosen.
const Theme& theme();
void use_theme(bool light);

}  // namespace palpate::viz
