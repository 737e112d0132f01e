// The measurements, the raw image's frame and the controls around the surface.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "capture/session.h"
#include "capture/source.h"
#include "engine/frame.h"
#include "engine/sensor.h"
#include "engine/touch.h"
#include "viz/hud_frame.h"
#include "viz/latency.h"
#include "viz/surface_view.h"
#include "viz/view_state.h"

namespace palpate::viz {

/// Where a replay is.
struct PlayerStats {
  uint64_t frames = 0;    ///< of the recording
  uint64_t position = 0;  ///< frame that was read last, from 0
  double speed = 1;
  bool at_end = false;
};

/// How a live session runs; shown at the window's foot.
struct LiveStats {
  double captured_per_s = 0;
  double processed_per_s = 0;
  double shown_per_s = 0;
  Percentiles to_measured;  ///< from the frame's exposure, where it is known, else its delivery
  Percentiles to_shown;     ///< from there to the picture handed to the display
  uint64_t captured = 0;
  uint64_t processed = 0;
  uint64_t shown = 0;
  uint64_t dropped_before_engine = 0;   ///< newer frames came while the engine was busy
  uint64_t dropped_before_display = 0;  ///< measured, but newer results came before they were shown
  double draw_ms = 0;                   ///< host time from submission to fence of a typical picture
  CaptureCounts camera;                 ///< what never got here
  std::string state;                    ///< why no frames come; empty while they do
  bool recording = false;
  SessionStatus session;  ///< of the session in hand, or of the last one
  std::optional<PlayerStats> player;
  std::string note;  ///< "end of recording", "paused"
};

/// Where things are in a picture of this size, px.
struct Layout {
  ViewRect surface;  ///< of the 3D view, or of the large raw image when there is no surface
  ViewRect view;     ///< what the eye sees, around the room beside the colour bar; reaches out of `surface`
  ViewRect panel;    ///< measurements
  ViewRect image;    ///< raw image; inside panel, or inside surface when there is no surface
  ViewRect status;   ///< one line at the foot
};
/// Room beside the surface for the colour bar, and around the pad for the axes' labels, at scale 1.
inline constexpr double kColourBarRoom_px = 92;
inline constexpr double kLabelRoom_px = 52;
Layout make_layout(VkExtent2D extent, float scale, const FrameFormat& format, bool has_surface);

/// What the display is about in this picture.
struct HudContent {
  const Sensor& sensor;
  const Frame& frame;
  const Touch& touch;
  bool has_surface = false;
  const LiveStats* live = nullptr;  ///< null: a picture of a recording
  std::string device;
  std::pair<uint32_t, uint32_t> mesh{0, 0};
};

class Hud {
 public:
  /// Remembers this frame for the force trace; once a result, however often it is drawn.
  void follow(const Touch& touch);
  /// Describes everything to ImGui between HudFrame::begin and draw; may change `state` (a person moved a
  /// slider).
  void describe(HudFrame& frame, const Layout& layout, const HudContent& content, ViewState& state,
                const Eye* eye, const Vec3& half_mm);

 private:
  struct Sample {
    double time_s;
    double value;
  };
  void measurements(HudFrame& frame, const Layout& layout, const HudContent& content);
  void trace(float width, float height, float scale) const;

  std::deque<Sample> trace_;
  bool trace_is_force_ = false;
  double full_shear_N_ = 0.1;  ///< largest tangential force seen: the length of the arrow
};

/// Words and colour (red, green, blue, 0 to 255) for the trust in a force.
struct Verdict {
  const char* words;
  uint8_t red, green, blue;
};
Verdict force_verdict(Validity validity);

}  // namespace palpate::viz
