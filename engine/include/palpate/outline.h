// Outline of the pad in the rectified frame: anything else in the image (a frame, a rim, the room) carries no
// measurement.
#pragma once

#include <array>
#include <variant>
#include <vector>

namespace palpate {

/// Pixel coordinates of centres: (0, 0) is the centre of the top left pixel, x right, y down. A pixel belongs
/// to the pad where its centre lies inside the outline or on it.
struct PadRectangle {
  double x = 0, y = 0, width = 0,
         height = 0;  ///< px; the centres of its corner pixels are x .. x + width - 1
};
struct PadEllipse {
  double x = 0, y = 0;                ///< centre, px
  double radius_x = 0, radius_y = 0;  ///< semi-axes, px; equal: a circle
  double angle_rad = 0;               ///< of the first axis from +x towards +y
};
struct PadPolygon {
  std::vector<std::array<double, 2>>
      corners;  ///< px, three at least, either way round; holes by the even-odd rule
};
using PadOutline = std::variant<PadRectangle, PadEllipse, PadPolygon>;

}  // namespace palpate
