// Moved objects: height maps of a rigid object that is pressed into the pad and moved along a known path.
#pragma once

#include <cstdint>
#include <random>
#include <vector>

#include "capture/synthetic/object_shapes.h"
#include "engine/motion/height_map.h"
#include "engine/motion/rigid_motion.h"

namespace palpate::scenes {

/// Noise of depth: white, of one reach, or as that of a surface that was integrated from slopes.
enum class DepthNoise { None, White, Reach3, Integrated };

/// What a frame holds; HeightMap refers to it.
struct PressedMap {
  uint32_t width, height;
  double pitch_mm;
  std::vector<float> depth;
  std::vector<uint8_t> contact;
  HeightMap map() const {
    return {
        .width = width, .height = height, .pitch_mm_per_px = pitch_mm, .depth_mm = depth, .contact = contact};
  }
};

/// Pads are round where the object reaches beyond them: nothing touches outside radius_mm.
struct PadView {
  uint32_t width = 160, height = 120;
  double pitch_mm = 0.1;
  double skin_px = 1.5;  ///< standard deviation of the skin's smoothing
  double radius_mm = 5.5;
  /// Standard error of slopes that stays with the pad, as a wrong calibration's, over reaches of 3 to 48 px;
  /// the same in every frame.
  double slope_error = 0;
  uint32_t slope_seed = 77;  ///< of that error
};

/// A hand's way: slides to and fro by 2 mm, turns by 35 degrees and tilts by 3, over ten seconds.
RigidMotion on_path(double time_s);

/// The moved object's depth at each pixel, smoothed by the skin, with noise of that standard deviation.
PressedMap pressed(const SolidObject& object, const RigidMotion& motion, const PadView& pad, double noise_mm,
                   DepthNoise kind, std::mt19937& random);

}  // namespace palpate::scenes
