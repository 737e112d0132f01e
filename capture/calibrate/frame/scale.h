// Scale of a sensor from pictures of something of known size.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "engine/calibrate/grid_fit.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

enum class GridPattern {
  Chessboard,  ///< columns x rows of inner corners
  Dots,        ///< dark or light dots in columns and rows
};

/// Points of a grid in one picture, row by row; nothing where not every point is found. With `rest` (the
/// untouched image) the change from it is looked at: a board of pegs pressed into the pad. A chessboard may
/// lie at any turn, from 15 % of the picture's width on.
std::optional<GridView> find_grid(const Frame& picture, const Frame* rest, GridPattern pattern, int columns,
                                  int rows, double spacing_mm);

/// A length and its standard error.
struct Scale {
  double pitch_mm_per_px = 0;
  double pitch_sd_mm_per_px = 0;
  double size_px = 0;  ///< what was measured
  std::string note;
};

/// The outline of a ring or disc of outer diameter `diameter_mm` that changes the picture: an ellipse fitted
/// to its edge at half of the change. Throws Error(Failure::Input) where nothing round is seen whole.
Scale scale_from_ring(const Frame& picture, const Frame& rest, double diameter_mm);

/// Presses of a ball with known travel between them: the squared contact radius grows with the travel, by 2 R
/// where the pad stays flat around the ball (a rigid cut) and by R in a half space (Hertz); a real pad lies
/// between, so the scale is their geometric mean and half their distance its error. `radii_px` and
/// `travel_mm` go together, three or more. Throws Error(Failure::Input) where they do not rise together.
Scale scale_from_ball(const std::vector<double>& radii_px, const std::vector<double>& travel_mm,
                      double ball_radius_mm);

}  // namespace palpate
