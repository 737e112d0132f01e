// Camera, pad and script of the built-in sensor.
#pragma once

#include <cstdint>
#include <string>

namespace palpate {

enum class SyntheticMode {
  Waveguide,  ///< gray, glows with contact pressure; touch light within 2 % of uniform (falloff)
  Gel,        ///< three coloured lights at 120 degrees on a Lambertian skin: red, green, blue planes
  Lambert,    ///< gray, the contact shows facing_gray * n_z and nothing glows around it: the truth of
              ///< SurfaceReading::Shading
};

/// Contact pressure to light.
enum class SyntheticResponse {
  Linear,      ///< gray = s p: the gray sum is linear in force
  Saturating,  ///< gray = S (1 - exp(-s p / S)), S 180 gray of 8 bit: light trapped per area has a limit
};

/// Pattern that shows the tangential motion of the skin. Under printed or rough skin the light varies with
/// it.
enum class SyntheticSkin {
  None,
  Markers,  ///< dark dots 1 mm apart, 0.34 mm across
  Texture,  ///< random, 20 % of the light, grains of about 0.2 mm
};

/// Finger of a gripper that the scene "grip" shows.
enum class SyntheticSide { Left, Right };

/// Object of the scene "grip", which both fingers hold.
struct SyntheticGrip {
  SyntheticSide side = SyntheticSide::Left;
  double weight_N = 0.4;          ///< friction on both pads carries it while it is lifted
  double stiffness_N_per_mm = 2;  ///< force over thickness lost
  double thickness_mm = 20;       ///< without force
  double skew_ms = 0;             ///< the right camera takes each frame so much later than the left one

  bool operator==(const SyntheticGrip&) const = default;
};

/// Camera, pad and script. Ranges are checked; a bad value is Error(Failure::Input).
struct SyntheticOptions {
  std::string scene = "palpation";  ///< one of synthetic_scenes()
  uint32_t width = 640;             ///< px; the field of view is always 27.84 mm wide
  uint32_t height = 480;
  uint32_t bit_depth = 8;  ///< 8 to 16; 8 in SyntheticMode::Gel
  SyntheticMode mode = SyntheticMode::Waveguide;
  SyntheticResponse response = SyntheticResponse::Linear;
  uint64_t seed = 1;  ///< of all noise, fixed pattern included
  double rate_Hz = 30;
  uint32_t repeat = 1;  ///< the scene is played so many times; 0: without end
  bool noise = true;    ///< shot and read noise, fixed pattern
  /// Share of the touch light lost in the corners, as a flat field correction in the camera leaves it.
  double falloff = 0.015;
  double force_N = 0;                        ///< largest force of the scene; 0: the scene's own
  double indenter_radius_mm = 0;             ///< of the sphere or the flat end; 0: the scene's own
  SyntheticSkin skin = SyntheticSkin::None;  ///< others need frames at least 320 px wide
  /// Waveguide: unloading glows as a force larger by up to this fraction of the scene's largest force does
  /// while loading; the difference is largest at half of that force and does not depend on speed.
  double hysteresis = 0;
  double drift_per_min = 0;  ///< Waveguide: fraction by which the touch light grows in a minute

  SyntheticGrip grip = {};

  double pad_young_MPa = 0.2;
  double pad_thickness_mm = 6;
  double friction = 0.5;
};

/// Whether these show a finger of a grip.
inline bool is_grip(const SyntheticOptions& options) {
  return options.scene == "grip";
}
/// How much later than the left finger's the frames of this one are taken.
inline double skew_ms(const SyntheticOptions& options) {
  return is_grip(options) && options.grip.side == SyntheticSide::Right ? options.grip.skew_ms : 0;
}

}  // namespace palpate
