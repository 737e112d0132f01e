// Layout of a picture: from 480 x 320 to any size, at any scale of the text.
#pragma once

#include <vulkan/vulkan.h>

#include "palpate/frame.h"
#include "viz/render/surface_view.h"

namespace palpate::viz {

/// Parts with a place of their own beside the surface and the measurements.
struct Panels {
  bool charts = true;
  bool profile = false;  ///< depth along the section line; where there is a surface
  double dock = 0;       ///< width of a column beside the surface for settings or calibrations, at scale 1
  bool player = false;   ///< a bar between the surface and the charts
  bool tools = false;    ///< a bar of buttons above the surface
};

/// Places, px. An absent panel is 1 x 1 px large and not drawn.
struct Layout {
  ViewRect surface;  ///< of the 3D view, or of the large raw image when there is no surface
  ViewRect tools;    ///< bar of buttons, above the surface
  ViewRect dock;     ///< settings or calibrations, left of the surface
  ViewRect player;   ///< bar of a replay, below the surface
  ViewRect charts;   ///< strip charts, below the surface
  ViewRect profile;  ///< of the section line, next to them
  ViewRect panel;    ///< measurements
  ViewRect image;    ///< raw image; inside panel, or inside surface when there is no surface
  ViewRect status;   ///< one line at the foot
  bool has_tools = false;
  bool has_dock = false;
  bool has_player = false;
  bool has_charts = false;
  bool has_profile = false;
};
/// Room beside the surface for the colour bar, and around the pad for the axes' labels, at scale 1.
inline constexpr double kColourBarRoom_px = 92;
inline constexpr double kLabelRoom_px = 52;
/// The same of this layout.
ViewMargins margins_of(const ViewRect& surface, float scale);

/// `scale`: of text and panels, 1 for 96 dpi. Where the picture is too low for charts there are none.
Layout make_layout(VkExtent2D extent, float scale, const FrameFormat& format, bool has_surface,
                   const Panels& panels = {});

}  // namespace palpate::viz
