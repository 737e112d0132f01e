// Touched depths: a frame's depths below rest and the object's contact in them, as a map of the object takes
// them.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/motion/height_map.h"
#include "palpate/frame.h"

namespace palpate {

/// Of the way from a frame's lowest fiftieth to its deepest, unless something else is asked for.
inline constexpr double kContactShare = 0.3;

class TouchedDepths {
 public:
  static constexpr double kBetween_mm = 1.5;

  /// Places deeper than `share` of the way from a frame's lowest fiftieth to its deepest count as touched,
  /// > 0 and < 1; with them what is deeper than half of that and lies between such places, no farther than
  /// kBetween_mm from one.
  TouchedDepths(const FrameFormat& format, double pitch_mm, double share)
      : width_(format.width), height_(format.height), pitch_mm_(pitch_mm), share_(share) {}

  /// Of a frame's depths, mm, whose standard error is `depth_sd_mm`; without a contact where nothing touches.
  /// Valid until the next call, and as long as `depth_mm`.
  HeightMap of(std::span<const float> depth_mm, bool touched, double depth_sd_mm);

 private:
  void close(std::span<const float> depth_mm, float least_mm);

  uint32_t width_, height_;
  double pitch_mm_, share_;
  std::vector<float> sorted_;
  std::vector<uint8_t> contact_;
};

}  // namespace palpate
