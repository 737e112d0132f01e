// Corners of the lit pad in the camera's picture.
#pragma once

#include <array>
#include <optional>

#include "palpate/frame.h"

namespace palpate {

struct PadCorners {
  std::array<std::array<double, 2>, 4> quad_px{};  ///< top left, top right, bottom right, bottom left
  double share = 1;                                ///< of the picture's area
  std::array<uint32_t, 2> size_px{};               ///< of the rectified frame: see size_of
};

/// The largest lit region of an untouched picture (brighter than what Otsu's threshold separates) as the
/// quadrilateral around it, drawn in by a fiftieth. Empty where it fills more than nine tenths of the
/// picture, or less than a tenth: there is nothing to cut away, or nothing to see.
std::optional<PadCorners> propose_corners(const Frame& untouched);

/// The rectified frame's size for corners, px: as wide as the longer of the upper and lower side, and of the
/// shape that the means of opposite sides have.
std::array<uint32_t, 2> size_of(const std::array<std::array<double, 2>, 4>& quad_px);

}  // namespace palpate
