// Exact sums over a contact: all that its place, shape and force are measured from.
#pragma once

#include <cstdint>

namespace palpate {

/// Exact sums over the contact pixels, those whose filtered gray g reaches the threshold. x and y count from
/// the pixel (width / 2, height / 2), rounded down, so that large frames lose no digits; g is in 1/256 gray
/// levels (Eq. 53, 55-58). With at most 2^26 pixels (kMaxPixels), |x| and |y| at most 2^13 and g below 2^24,
/// every sum stays below 2^63: the largest, sum g |x|, is at most 2^24 * 2^26 * 2^12, since |x| averages a
/// quarter of the width over a full frame.
struct ContactMoments {
  uint64_t area = 0;
  uint64_t gray = 0;
  int64_t gray_x = 0;
  int64_t gray_y = 0;
  int64_t x = 0;
  int64_t y = 0;
  int64_t xx = 0;
  int64_t xy = 0;
  int64_t yy = 0;
  uint32_t peak = 0;       ///< largest g
  uint64_t saturated = 0;  ///< raw pixels that touch has brought to the saturation level, in the whole frame
  bool border = false;     ///< contact pixels in the frame's outermost rows or columns

  bool operator==(const ContactMoments&) const = default;
};

}  // namespace palpate
