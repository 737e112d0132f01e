// Judges a smooth change of a gel's image: the pad gives way, or light glows through it.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

/// The image of a gel changes around a contact too: light glows, and the pad moves. A correction by what is
/// at rest takes the heights of places outside of outlines for errors of the surface. Where the colours'
/// slopes there are those of the surface that was integrated from them, they are no light: light asks for
/// slopes that no surface has. On a GelSight Wedge both come together, and after a press the pad creeps back:
/// that is no touch, and no rest either.
class SmoothTouch {
 public:
  static constexpr double kLeast_mm = 0.1;      ///< taken off, from which it matters,
  static constexpr double kOfDepth = 0.5;       ///< and of the depth that is left
  static constexpr double kSureMisfit = 0.03;   ///< of the slopes' mean square, that no surface explains:
  static constexpr double kMostMisfit = 0.15;   ///< of a touch; of what may be one
  static constexpr double kLeastSlope = 0.035;  ///< RMS
  static constexpr size_t kLeastCells = 40;

  /// A frame's cells of 4 x 4 px, row by row.
  struct Cells {
    std::span<const uint8_t> at_rest;                 ///< not 0: outside of every contact
    std::span<const float> raised;                    ///< mean square change over noise, smoothed
    std::span<const float> level_mm;                  ///< what the correction takes off
    std::span<const float> depth_mm;                  ///< and leaves
    const std::array<std::vector<float>, 3>& change;  ///< means of red, green and blue, gray levels
  };

  SmoothTouch(const Sensor& sensor, const FrameFormat& format);

  enum class TakenOff { Nothing, PerhapsTouch, Touch };
  TakenOff look_at(const Cells& cells);

 private:
  double taken_off_mm(const Cells& cells);
  void find_slopes(const std::array<std::vector<float>, 3>& change_gray);

  const Sensor* sensor_;
  double max_gray_;
  size_t cells_x_, cells_y_;
  std::vector<float> still_, changed_;
  std::vector<std::array<double, 2>> slopes_;  ///< of each cell: across, down
};

}  // namespace palpate
