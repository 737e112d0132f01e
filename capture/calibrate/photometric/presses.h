// Presses of a ball or of another known shape in a recording: detected in every frame, or listed in a table.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/calibrate/ball/finder.h"
#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// One press with its picture.
struct BallPress {
  std::string label;  ///< file, or file and frame
  Frame frame;
  FoundBall ball;
  PressedShape shape{};
  std::vector<uint8_t> mask{};  ///< height x width, 1: a printed marker, or another contact; empty: none
  bool markers = false;         ///< there are printed ones
};

struct RefusedPress {
  std::string label;
  std::string reason;
  BallRefusal why = BallRefusal::None;
  FoundBall ball{};  ///< what the search ended with
  PressedShape shape{};
};

struct BallPresses {
  FrameFormat format;
  Frame background;  ///< of the first file, for pictures; each press was compared with its own
  std::vector<BallPress> presses;
  std::vector<Frame> backgrounds;     ///< one for each press
  std::vector<RefusedPress> refused;  ///< frames in which something is pressed that cannot be used
  size_t frames_with_ball = 0;        ///< those of one press count each; less those refused later
  uint64_t untouched = 0;             ///< frames in which nothing is
  std::array<double, 3> frame_sd{};   ///< StillNoise::sd of those
  std::string warning;                ///< that the untouched image shows a touch itself; empty: it does not
};

struct PressSearch {
  PressedShape shape{};
  bool mask_markers = true;
  uint64_t every = 0;  ///< looks at every n-th frame of a video; 0: so that at most 400 are looked at
  /// Called with frames looked at and their number (0: not known), and true ends the search.
  std::function<bool(uint64_t, uint64_t)> progress;
  /// Called with all that was found, used and refused, before the presses are counted; may throw.
  std::function<void(const BallPresses&)> judge;
};

inline constexpr const char* kBallColumns = "image,center_x_px,center_y_px,contact_radius_px,ball_radius_mm";
/// Columns of presses of other shapes, which may stand in the same table: `shape` (shape_text.h; empty: a
/// ball of `ball_radius_mm`), and for a cylinder the direction of its axis from x towards y and the contact's
/// length, whose half width is `contact_radius_px`.
inline constexpr const char* kShapeColumns = "shape,axis_deg,length_px";

/// Looks at every frame of `input` (folder of images, image, video, session, synthetic scene). Of a press
/// that lasts several frames the deepest counts: a new one begins where the contact has moved by half its
/// radius, or its radius changed by a sixth. With colour, presses whose change grows unlike the others' are
/// refused, but not those of a cylinder, for which it depends on how the cylinder lies to the lights. Throws
/// Error(Failure::Input) where there are fewer than `least` presses, with what was found
/// instead.
BallPresses find_presses(const std::string& input, const Sensor& sensor, const PressSearch& search,
                         size_t least);

/// Takes press `i` out as unlike the others.
void refuse_press(BallPresses& found, size_t i, const std::string& reason);

/// The presses that the table `file` names (kBallColumns, kShapeColumns), below the folder `input` or in the
/// one file that it is. Throws Error(Failure::Input).
BallPresses read_presses(const std::filesystem::path& file, const std::filesystem::path& input,
                         const Sensor& sensor, bool mask_markers);

}  // namespace palpate
