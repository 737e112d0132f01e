// Moved objects: height maps of a rigid object that is pressed into the pad and moved along a known path.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "engine/motion/height_map.h"
#include "engine/motion/rigid_motion.h"

namespace palpate::scenes {

inline constexpr double kDegree = M_PI / 180;

/// The object's surface: its depth in the pad over x and y, mm, as it lies before it moves.
struct SolidObject {
  std::string name;
  std::function<double(double x_mm, double y_mm)> depth_mm;
};

/// A dome of 30 mm radius with waves of about 1.5 mm in all directions.
SolidObject textured_dome(double relief_mm = 0.04);
/// The same waves without the dome: it fills the pad wherever it slides.
SolidObject textured_plane();
SolidObject ball(double radius_mm = 8, double depth_mm = 0.7);
SolidObject plane(double depth_mm = 0.4);
/// Along a line that is no axis of the pad.
SolidObject cylinder(double radius_mm = 6, double depth_mm = 0.6);
SolidObject ellipsoid();
/// A thread of one turn in 1.5 mm about a line along x.
SolidObject screw(double radius_mm = 5, double pitch_mm = 1.5);
/// A bow, a shaft and a bit with teeth, on a slight dome.
SolidObject key_relief();
/// A ring, a bar and dots on a flat ground.
SolidObject coin();

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
};

/// A hand's way: slides to and fro by 2 mm, turns by 35 degrees and tilts by 3, over ten seconds.
RigidMotion on_path(double time_s);

/// The moved object's depth at each pixel, smoothed by the skin, with noise of that standard deviation.
PressedMap pressed(const SolidObject& object, const RigidMotion& motion, const PadView& pad, double noise_mm,
                   DepthNoise kind, std::mt19937& random);

}  // namespace palpate::scenes
