// View of a depth map on the host, from which files of every format are written.
#pragma once

#include <cstdint>
#include <span>

namespace palpate {

/// A depth map on the host: height x width floats, mm below the pad's rest level.
struct DepthView {
  std::span<const float> depth_mm;
  uint32_t width = 0;   ///< px
  uint32_t height = 0;  ///< px
  double pitch_mm_per_px = 0;
};

}  // namespace palpate
