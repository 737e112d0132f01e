// How far heights by a stack of lights are from known ones, on pixels that the fit did not use.
#pragma once

#include <cstdint>
#include <span>

#include "engine/calibrate/light_stack.h"

namespace palpate {

struct LevelledError {
  double rms_mm = 0;  ///< NaN: no pixel counts
  uint64_t pixels = 0;
};

/// Where `use` is not 0 and the truth is a number; both width x height. Offset and tilt, which slopes do not
/// carry, are removed by least squares over those pixels.
LevelledError levelled_error(std::span<const float> height_mm, std::span<const float> truth_mm,
                             std::span<const uint8_t> use, uint32_t width);

struct HeldOutHeights {
  int order = 0;
  double bands_mm = 0;   ///< every other eighth of the rows held out, both ways: places seen, shapes not
  double halves_mm = 0;  ///< the upper and the lower half held out: places not seen either
};

/// Throws as fit_light_stack does.
HeldOutHeights judge_light_stack(const LightImages& images, std::span<const float> truth_mm,
                                 double pitch_mm_per_px, int order);

}  // namespace palpate
