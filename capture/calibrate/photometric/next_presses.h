// Where further presses of a known shape would serve a calibration best.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

namespace palpate {

/// A press of a known shape as a calibration found it, px of the rectified frame.
struct FoundPress {
  std::string label;  ///< of its picture
  double x_px = 0, y_px = 0, radius_px = 0;
  double depth_error_mm = 0;  ///< RMS by a calibration without it
  std::string refusal;        ///< why it is not used; empty: it is
};

/// One of nine equal parts of the pad, px of the rectified frame.
struct PressPlace {
  double left_px = 0, top_px = 0, right_px = 0, bottom_px = 0;
  std::string reason;
};

/// The part without any press that is used, the one farthest from all; else the one whose depth is wrong by
/// more than half as much again as in the usual part; none where they are alike, or no press is used.
std::optional<PressPlace> place_for_presses(std::span<const FoundPress> presses, uint32_t width_px,
                                            uint32_t height_px);

}  // namespace palpate
