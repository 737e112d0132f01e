// Skin texture: what a relief shows of the skin within a band of lengths, without the pressure under it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "engine/palpation/hand/hand_press.h"

namespace palpate {

/// On pixels whose middle is the window's; 0 where nothing touches.
struct TextureMap {
  int width = 0, height = 0;
  double pitch_mm = 0;
  std::vector<float> value;   ///< in its own spread, cut off at three of them: a rim is no texture
  std::vector<uint8_t> seen;  ///< not 0 where the skin touches

  size_t at(int x, int y) const {
    return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
  }
  /// Mean square of what is seen; 0: nothing is.
  double power() const;
};

/// Between means by Gauss functions of these standard deviations; pixels of up to 0.15 mm are put together.
TextureMap skin_texture(const SkinRelief& relief, double fine_mm, double slow_mm);

/// Value between pixels, x and y in px from the first one; false where one of the four is not seen.
bool texture_between(const TextureMap& texture, double x, double y, float& value);

}  // namespace palpate
