// Uneven light of a sensor as a field to multiply with (FlatField in palpate/sensor.h).
#pragma once

#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

struct FlatFit {
  Frame image;               ///< one plane of 16 bits
  double gain = 0;           ///< per gray level of the image
  double uneven_before = 0;  ///< standard deviation over mean of the smoothed light, on frames not used
  double uneven_after = 0;   ///< the same once corrected by the field of the other frames
  double least = 1;          ///< smallest and largest factor
  double most = 1;
  double limited = 0;  ///< fraction of the pixels whose factor is held at 1/4 or 4
};

/// Frames of what should look even, two or more of one format, minus `dark` (the untouched image) where that
/// is given: the light of a touch. Brightness over all channels counts, smoothed over 1/50 of the width;
/// pixels of `mask` (1: leave out, may be empty) and saturated ones do not. Throws Error(Failure::Input) with
/// fewer frames, or where more than a fifth of the frame is dark.
FlatFit fit_flat(const std::vector<Frame>& frames, const Frame* dark, const std::vector<uint8_t>& mask,
                 const Sensor& sensor);

}  // namespace palpate
