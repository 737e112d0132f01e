#include "viz/look/theme.h"

#include <algorithm>
#include <cmath>

namespace palpate::viz {
namespace {

// Curves and states keep the order of Okabe and Ito's colours, which colour-blind people can tell apart.
constexpr Theme kDark{.ground = {30, 33, 38},
                      .panel = {19, 21, 25},
                      .chart = {25, 28, 34},
                      .field = {41, 46, 56},
                      .picked = {32, 58, 90},
                      .grid = {52, 58, 68},
                      .frame = {84, 92, 104},
                      .text = {230, 235, 240},
                      .faint = {160, 168, 180},
                      .valid = {92, 214, 190},
                      .doubtful = {240, 190, 70},
                      .wrong = {255, 136, 126},
                      .slips = {255, 150, 84},
                      .chosen = {104, 192, 240},
                      .second = {230, 159, 0},
                      .third = {226, 150, 194},
                      .depth = {60, 205, 160},
                      .limit = {240, 228, 66}};
constexpr Theme kLight{.ground = {233, 236, 240},
                       .panel = {247, 248, 250},
                       .chart = {255, 255, 255},
                       .field = {221, 226, 234},
                       .picked = {190, 214, 238},
                       .grid = {224, 228, 234},
                       .frame = {150, 158, 170},
                       .text = {22, 26, 32},
                       .faint = {74, 82, 94},
                       .valid = {0, 92, 78},
                       .doubtful = {112, 68, 0},
                       .wrong = {160, 20, 20},
                       .slips = {140, 48, 0},
                       .chosen = {0, 76, 140},
                       .second = {112, 68, 0},
                       .third = {130, 36, 96},
                       .depth = {0, 92, 62},
                       .limit = {92, 76, 0}};

thread_local bool light_in_use = false;

/// Relative luminance, 0 to 1.
double luminance(Rgb c) {
  const auto linear = [](uint8_t channel) {
    const double v = channel / 255.0;
    return v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
  };
  return 0.2126 * linear(c.red) + 0.7152 * linear(c.green) + 0.0722 * linear(c.blue);
}

}  // namespace

double contrast(Rgb a, Rgb b) {
  const auto [darker, lighter] = std::minmax({luminance(a), luminance(b)});
  return (lighter + 0.05) / (darker + 0.05);
}

Rgb Theme::of(Meaning meaning) const {
  switch (meaning) {
    case Meaning::Explains:
      return faint;
    case Meaning::Valid:
      return valid;
    case Meaning::Doubtful:
      return doubtful;
    case Meaning::Wrong:
      return wrong;
    case Meaning::Slips:
      return slips;
    case Meaning::Chosen:
      return chosen;
    default:
      return text;
  }
}

const Theme& dark_theme() {
  return kDark;
}

const Theme& light_theme() {
  return kLight;
}

const Theme& theme() {
  return light_in_use ? kLight : kDark;
}

void use_theme(bool light) {
  light_in_use = light;
}

}  // namespace palpate::viz
