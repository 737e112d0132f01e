// Numbers and lines over the pictures: axes and colour bar in mm on the surface, the measured contact on the
// raw image.
#pragma once

#include "engine/sensor.h"
#include "engine/touch.h"
#include "viz/camera.h"
#include "viz/surface_view.h"

struct ImDrawList;

namespace palpate::viz {

/// Axes along the pad's near edges and down its left corner, ticks in mm; x and y from the pad's centre, y
/// down the image.
void draw_axes(ImDrawList* list, const Eye& eye, const ViewRect& clip, const ViewRect& view,
               const Vec3& half_mm, const SurfaceStyle& style, float scale);

/// Vertical bar, rest at the top, ticks in mm of depth.
void draw_colour_bar(ImDrawList* list, const ViewRect& rect, const SurfaceStyle& style, bool automatic,
                     float scale);

/// Contact ellipse, centroid and tangential force over the raw image in `rect`. `full_shear_N`: force of an
/// arrow of full length.
void draw_contact(ImDrawList* list, const ViewRect& rect, const Touch& touch, const Sensor& sensor,
                  uint32_t image_width, double full_shear_N, float scale);

}  // namespace palpate::viz
