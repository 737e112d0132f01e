// Layout of a picture: from 480 x 320 to any size, at any scale of the text.
#pragma once

#include <vulkan/vulkan.h>

#include "palpate/frame.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// How surface and raw image share the picture.
enum class Arrangement : int {
  OneLarge,   ///< the other stands small over the numbers
  BothEqual,  ///< side by side, or one above the other where they are larger so
  OneAlone,   ///< without the other, the numbers and the charts
};
inline constexpr int kArrangements = 3;
const char* to_string(Arrangement arrangement);

/// Parts with a place of their own beside the surface and the measurements.
struct Panels {
  bool charts = true;
  bool profile = false;     ///< depth along the section line; where there is a surface
  double dock = 0;          ///< width of a column beside the surface for settings or calibrations, at scale 1
  bool player = false;      ///< a bar between the surface and the charts
  bool tools = false;       ///< a bar of buttons above the surface
  bool headline = false;    ///< in its place the answer, of a picture that is sent on
  uint32_t chart_rows = 2;  ///< charts below each other; of a picture three have more room
  Arrangement arrangement = Arrangement::OneLarge;
  bool image_large = false;  ///< the image is the large, first or only one; it is without a surface
  bool map = false;          ///< of what the pad moves over, beside them
};

/// Places, px. An absent panel is 1 x 1 px large and not drawn.
struct Layout {
  ViewRect pictures;      ///< what is not small of surface, image and map
  ViewRect surface;       ///< of the 3D view; inside pictures or panel
  ViewRect image;         ///< raw image; inside pictures or panel
  ViewRect map;           ///< of what the pad moves over; inside pictures
  ViewRect tools;         ///< bar of buttons, above the pictures
  ViewRect headline;      ///< there, of a picture without buttons
  ViewRect dock;          ///< settings or calibrations, left of the pictures
  ViewRect player;        ///< of a replay, below the pictures: marks, thumbnails, buttons
  ViewRect strip;         ///< its thumbnails
  ViewRect charts;        ///< strip charts, below the pictures
  ViewRect profile;       ///< of the section line, next to them
  ViewRect panel;         ///< measurements
  ViewRect status;        ///< one line at the foot
  int32_t numbers_y = 0;  ///< in panel, where they begin: below its heading, or the small picture
  bool has_surface = false;
  bool has_image = false;
  bool has_map = false;
  bool has_panel = false;
  bool has_tools = false;
  bool has_headline = false;
  bool has_dock = false;
  bool has_player = false;
  bool has_charts = false;
  bool has_profile = false;
};
/// Room beside the axis of time, of the charts and of a replay's thumbnails, at scale 1.
inline constexpr double kAxisLeft_px = 52, kAxisRight_px = 10;
/// Room beside the surface for the colour bar, and around the pad for the axes' labels, at scale 1.
inline constexpr double kColourBarRoom_px = 92;
inline constexpr double kLabelRoom_px = 52;
/// A rectangle of whole pixels, at least one wide and high.
ViewRect rect_of(double x, double y, double width, double height);
/// The largest part of a room that has this width over height: in its middle, or at its top.
ViewRect fitted(const ViewRect& room, double aspect, bool at_top = false);
/// Width over height of what has both.
template <typename Sized>
double aspect_of(const Sized& of) {
  return static_cast<double>(of.width) / (of.height > 0 ? of.height : 1);
}
/// Whether the surface has this room; else its grid alone shows lengths, and its colours have a low bar.
bool is_roomy(const ViewRect& surface, float scale);
/// Room around the pad.
ViewMargins margins_of(const ViewRect& surface, float scale);

/// `scale`: of text and panels, 1 for 96 dpi. Where the picture is too low for charts there are none.
Layout make_layout(VkExtent2D extent, float scale, const FrameFormat& format, bool has_surface,
                   const Panels& panels = {});

}  // namespace palpate::viz
