// Two frames of a recording as tactile shapes: their control points, and the followed points of the pad's
// skin.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "capture/run/input.h"
#include "capture/run/run_watch.h"
#include "engine/measure/compression.h"
#include "palpate/touch.h"

namespace palpate {
namespace gpu {
class Context;
}

struct TactileShape {
  Touch touch;
  ControlPoints control;  ///< of the first draw; empty where the sensor has no reading of the surface
  std::vector<std::vector<ShapePoint>> draws;  ///< control points, drawn kDraws times
  double contact_mm2 = 0;                      ///< touched area, mean over the draws
};

/// Draws of control points of each frame: their scatter gives the uncertainty of a strain.
inline constexpr size_t kDraws = 8;

struct ShapeRequest {
  std::optional<std::array<uint64_t, 2>> frames;  ///< numbers as in the column 'frame'
  std::optional<std::array<double, 2>> forces_N;  ///< the frames nearest to these, up to the peak; neither:
                                                  ///< half of the peak and the peak
  ControlOptions control;                         ///< the pitch is the sensor's
  bool one_sequence = false;                      ///< as of separate_presses()
};

struct TactileShapes {
  TactileShape before, after;
  bool separate = false;  ///< pictures of separate presses: nothing was followed from one to the next
  bool skin = false;      ///< the skin's points were followed from the first frame on

  /// Change of the touched area, counted, over that of the first; none without contact.
  std::optional<double> counted_growth() const;
};

/// Reads the recording, twice where frames are chosen by force. Throws Error(Failure::Input) where a frame or
/// a force is not there, Error(Failure::Usage) of a camera and of a sensor without surface and skin, or
/// without surface where the input is separate pictures.
TactileShapes read_shapes(gpu::Context& context, const MeasuredInput& input, const ShapeRequest& request,
                          const RunWatch& watch);

/// Skin points that were followed in both frames and lie in the contact of the second.
std::vector<MatchedPoint> skin_pairs(const TactileShapes& shapes, double pitch_mm_per_px);

}  // namespace palpate
