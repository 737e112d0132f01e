// Height map: the surface of what is pressed into the pad, as one frame shows it.
#pragma once

#include <cstdint>
#include <span>

namespace palpate {

/// Row-major, without gaps. Places in mm count from the picture's centre: x to the right, y down, z into the
/// pad, which is right-handed.
struct HeightMap {
  uint32_t width = 0;               ///< px
  uint32_t height = 0;              ///< px
  double pitch_mm_per_px = 0;       ///< > 0
  std::span<const float> depth_mm;  ///< below the untouched surface, finite
  /// Standard error of each depth, mm, > 0; empty: alike everywhere. Only ratios matter: the size of the
  /// error is estimated from what is left over.
  std::span<const float> sd_mm = {};
  /// Standard error of the whole map's level, mm: a shift of all depths, which nothing of what is left over
  /// shows.
  double level_sd_mm = 0;
  /// Standard error of the whole map's tilt, rad, about each axis along the pad; the same holds for it.
  double tilt_sd_rad = 0;
  std::span<const uint8_t> contact;  ///< not 0 where the object touches the pad
};

}  // namespace palpate
