// A line across the pad.
#pragma once

namespace palpate::viz {

/// From start to end; fractions of the frame's width and height, so that it suits every sensor.
struct SectionLine {
  double x0 = 0.08, y0 = 0.5, x1 = 0.92, y1 = 0.5;

  /// By fractions of the frame, kept inside.
  void move(double dx, double dy);
  void turn(double angle_rad, double aspect);  ///< about its middle; `aspect`: width over height
};

}  // namespace palpate::viz
