// Map eye: what a person sees of the map of what the pad moves over.
#pragma once

namespace palpate::viz {

struct MapEye {
  static constexpr double kLeast_px_per_mm = 0.5, kMost_px_per_mm = 2000;

  bool all = true;            ///< all of the map, however it grows; else:
  double x_mm = 0, y_mm = 0;  ///< place of the map in the middle
  double px_per_mm = 1;
};

}  // namespace palpate::viz
