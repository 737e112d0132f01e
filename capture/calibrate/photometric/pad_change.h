// Change of a pad between the untouched image of its calibration and another picture of it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"

namespace palpate {

/// One light over the whole picture, from places that follow it: a touch does not count.
struct PadLight {
  std::array<double, 3> change{};  ///< of each colour's level, relative; gray sensors have one
  double brightness = 0;           ///< mean of them
  double colour = 0;               ///< largest departure of one colour from that mean
  double share = 0;  ///< of the picture that follows one light, of the colour in which least does
};
PadLight light_between(const Frame& calibrated, const Frame& now, const Sensor& sensor);
/// The light of several pictures, some of which may be touched: medians, and the share of the one that is
/// most as it was.
PadLight light_of(const std::vector<PadLight>& lights);

/// Differences of two untouched images beyond one light.
struct PadPattern {
  double elsewhere_gray = 0;  ///< exceeded by a tenth of the picture, of 8 bits, means of 8 x 8 px
  uint64_t specks_px = 0;     ///< pixels that would be taken for a touch (evident_touch_px)
  double marker_scale = 0;  ///< spacing of printed markers over that of the calibration; 0: none are printed
  PictureFault fault = PictureFault::None;
};
PadPattern pattern_between(const Frame& calibrated, const Frame& now, const Sensor& sensor);

}  // namespace palpate
