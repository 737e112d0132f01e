// A press by hand: what a pad sees of tissue whose skin has texture, without a stage that says where.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/lump/observation/observation.h"
#include "engine/motion/height_map.h"

namespace palpate {

/// The skin's relief under the pad at one force, about the same for all presses of a scan: a block that is
/// pressed harder is wider, and its skin with it.
struct SkinRelief {
  uint32_t width = 0, height = 0;  ///< px, row by row along x; the window's middle in the middle
  double pitch_mm = 0;
  std::vector<float> depth_mm;   ///< into the pad
  std::vector<uint8_t> contact;  ///< not 0 where the skin touches the pad
  double force_N = 0;            ///< on the whole block

  HeightMap map() const {
    return {.width = width,
            .height = height,
            .pitch_mm_per_px = pitch_mm,
            .depth_mm = depth_mm,
            .contact = contact};
  }
};

struct HandPress {
  std::string name;               ///< for people
  lump::Observation observation;  ///< window_mm says nothing
  SkinRelief relief;
  /// Width of the block when the pad lay there over that of the relief, which is that at the scan's load.
  double wider = 1;
};

}  // namespace palpate
