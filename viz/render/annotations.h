// Numbers and lines over the pictures: axes and colour bar in mm on the surface, the measured contact on the
// raw image.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "engine/palpation/press_monitor.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"
#include "palpate/touch.h"
#include "viz/live/trail.h"
#include "viz/render/image/unknown_cells.h"
#include "viz/render/orbit.h"
#include "viz/render/surface_view.h"
#include "viz/render/view_state.h"

struct ImDrawList;

namespace palpate::viz {

/// A text and where it stands, px.
struct PlacedText {
  std::string words;
  float left = 0, top = 0, right = 0, bottom = 0;
};

/// Axes along the pad's near edges and down one of its outer corners, ticks in mm; x and y from the pad's
/// centre, y down the image. Returns its texts: none lies over another, and what has no room is left out.
std::vector<PlacedText> draw_axes(ImDrawList* list, const Eye& eye, const ViewRect& view, const Vec3& half_mm,
                                  const SurfaceStyle& style, float scale);

/// What the pad bears, as arrows over the surface at its rest level: shear along it, those at the limit of
/// `friction` (0: not known) in another colour, or pressure into it; with an arrow of known length as the
/// key. Nothing where it is not known.
void draw_traction(ImDrawList* list, const Eye& eye, const ViewRect& view, const Vec3& half_mm,
                   const TractionMaps& maps, TractionArrows shown, double friction, float scale);

/// Vertical bar, rest at the top, ticks of what the colours show: mm of depth, kPa, or % of strain.
void draw_colour_bar(ImDrawList* list, const ViewRect& rect, const SurfaceStyle& style, bool automatic,
                     float scale);

/// The same lying along the foot of a view without room for it: the quantity, and the value of the last
/// colour.
void draw_low_colour_bar(ImDrawList* list, const ViewRect& rect, const SurfaceStyle& style, float scale);

/// Options of the marks over the raw image.
struct ImageMarks {
  bool contacts = true;                   ///< outlines, ids, centroids, shear
  bool skin = true;                       ///< followed places of the skin and how far they have moved
  double full_shear_N = 1;                ///< tangential force of an arrow of full length
  float scale = 1;                        ///< of text and lines
  const UnknownCells* unknown = nullptr;  ///< hatched
  bool explains_unknown = false;          ///< says so in words, where nothing else does
  const Trail* trail = nullptr;           ///< of the object, with its axes
  double pitch_mm_per_px = 0;             ///< for the trail
};

/// Over the raw image in `rect`: each contact's ellipse, number and tangential force (of the whole touch
/// where contacts are not separated), places of the skin, what reaches the border, what is saturated, and
/// hatched what is not known.
void draw_touch(ImDrawList* list, const ViewRect& rect, const Touch& touch, const FrameFormat& format,
                const ImageMarks& marks);

/// The surface as it is seen in a picture.
struct SurfacePlace {
  const Eye& eye;
  const ViewRect& view;
  Vec3 half_mm;
};
/// The same over the surface, at its rest level: outlines, the deepest place of one contact in words or the
/// numbers of several, and hatched what is not known. Words that would lie over `placed` ones, or
/// over the colour bar, are left out.
void draw_touch(ImDrawList* list, const SurfacePlace& on, const Touch& touch, const FrameFormat& format,
                const ImageMarks& marks, std::vector<PlacedText> placed);

/// What the strokes mean, in a line whose left end is `at`: strokes, then words of at most `room_px`.
void draw_unknown_key(ImDrawList* list, std::array<float, 2> at, const UnknownCells& cells, float room_px,
                      float scale);

/// Over the raw image: the outline of a found lump seen from above, a circle of its size, with the interval
/// of its centre as a cross.
void draw_lump(ImDrawList* list, const ViewRect& rect, const PressAnswer& answer, const Sensor& sensor,
               const FrameFormat& format, float scale);

/// In the upper right corner of the raw image: the colours of the skin's strain with their range and the
/// strain's standard error, or why none is drawn.
void draw_strain_bar(ImDrawList* list, const ViewRect& rect, const StrainTexels& strain,
                     const ViewState& state, float scale);

}  // namespace palpate::viz
