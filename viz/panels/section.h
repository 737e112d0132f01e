// A line across the pad and the depth along it.
#pragma once

#include <cstdint>
#include <vector>

#include "engine/pipeline/surface_map.h"
#include "palpate/touch.h"
#include "viz/render/orbit.h"
#include "viz/render/section_line.h"
#include "viz/render/surface_view.h"

struct ImDrawList;

namespace palpate::gpu {
class Context;
}

namespace palpate::viz {

/// Depth along a section line, mm, at equal distances from start to end.
struct Profile {
  std::vector<float> depth_mm;
  double length_mm = 0;
  double rest_mm = 0;  ///< depth at the foot of the plot's axis: the rest level, 0

  struct Extreme {
    double at_mm = 0;  ///< from the line's start
    double depth_mm = 0;
  };
  Extreme least() const;  ///< meaningless without values
  Extreme most() const;
};

/// The depths under the line, bilinear between pixels, at least one sample a pixel up to 1024. Where the
/// map's memory is not the host's, it waits for a copy of those pixels alone. The map must be finished.
Profile probe(gpu::Context& context, const SurfaceMap& map, double offset_mm, double pitch_mm_per_px,
              const SectionLine& line);

/// A plot, mm of depth (downwards) against mm along the line, least and deepest labelled; `wrong` says why
/// the depths may be too small, or is empty.
void draw_profile(ImDrawList* list, const ViewRect& rect, const Profile& profile, const std::string& wrong,
                  float scale);

/// The line over the raw image in `rect`, its start a disc marked A and its end one marked B.
void draw_section(ImDrawList* list, const ViewRect& rect, const SectionLine& line, float scale);
/// The line over the surface, at the depths of `profile`; `half_mm`: half sizes of the pad.
void draw_section(ImDrawList* list, const ViewRect& view, const Eye& eye, const SectionLine& line,
                  const Profile& profile, const Vec3& half_mm, const SurfaceStyle& style, float scale);

/// Follows a mouse that drags an end, or the whole line by its middle, in the raw image or on the surface.
class SectionMouse {
 public:
  /// Once a picture, between ImGui's begin and end. `eye`: null without a surface. True while it holds the
  /// mouse, which then turns nothing else.
  bool follow(SectionLine& line, const ViewRect& image, const ViewRect& view, const Eye* eye,
              const Vec3& half_mm, float scale);

 private:
  enum class Held { Nothing, Start, End, All };
  Held held_ = Held::Nothing;
  bool on_image_ = false;
  double last_x_ = 0, last_y_ = 0;  ///< fractions of the frame
};

}  // namespace palpate::viz
