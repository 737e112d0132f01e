// Skin overlap: where two reliefs of one skin lie on each other, without any guess.
#pragma once

#include <array>

#include "engine/palpation/hand/hand_press.h"

namespace palpate {

/// The second relief's middle seen from the first one's, and its turn against it from +x towards +y.
struct SkinOverlap {
  std::array<double, 2> shift_mm = {0, 0};
  double turn_rad = 0;
  double correlation = 0;  ///< of the texture where both see it, -1 to 1
  /// Correlation times the square root of the pixels compared; chance alone reaches 6 or so, and a texture of
  /// few waves more, since it is like itself a wave farther.
  double significance = 0;
  double elsewhere = 0;  ///< the highest significance more than 1.2 mm from there, at any turn

  /// The skin is found: well above chance, and above the next best place.
  bool sure() const { return significance >= 9 && significance >= 1.9 * elsewhere; }
};

/// Correlation of the texture of 0.4 to 2 mm over all shifts that leave a fifth of the smaller relief, and
/// turns of up to `most_turn_rad` either way: right to half a millimetre and two degrees where it is sure.
SkinOverlap find_skin_overlap(const SkinRelief& first, const SkinRelief& second, double most_turn_rad = 0.2);

}  // namespace palpate
