// Contact shape: centroid, area and ellipse of a contact from its sums (Eq. 55-58).
#pragma once

#include "engine/measure/moments.h"
#include "palpate/touch.h"

namespace palpate {

/// The sums' own frame: what x and y count from, px, and the size of a pixel.
struct ShapeScale {
  double center_x_px = 0;
  double center_y_px = 0;
  double pitch_mm_per_px = 0;
};

/// Fills gray_sum, area, peak, at_border and, where there is an area, centroid and ellipse; without one the
/// centroid is NaN. Of `saturated_px` the sums' own count.
void set_shape(ContactTouch& contact, const ContactMoments& moments, const ShapeScale& scale);

}  // namespace palpate
