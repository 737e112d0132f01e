// Relief larger than the pad, and the ways that a pad goes over it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "engine/map/object_map.h"
#include "perf/motion/moved_object.h"

namespace palpate::scenes {

/// Rough at several scales, waves of 0.9 to 9 mm: 60 x 20 mm about its middle, and as much around as a pad
/// reaches.
class Relief {
 public:
  /// `smooth_mm`: width of a smooth band across its middle.
  explicit Relief(uint32_t seed = 5, double smooth_mm = 0);

  double depth_mm(double x_mm, double y_mm) const;
  /// As a skin shows it that smooths by a Gaussian of that standard deviation.
  Relief smoothed(double sd_mm) const;
  SolidObject object() const;

  static constexpr double kWidth_mm = 60, kHeight_mm = 20;

 private:
  uint32_t width_ = 0, height_ = 0;
  std::shared_ptr<const std::vector<float>> table_;
};

/// 16 x 12 mm that touch everywhere, 160 x 120 px, or twice as many.
PadView wide_pad(bool fine);

/// Where the pad is at each frame: motions from the relief to the pad, at 45 mm/s and 60 frames/s. Both end
/// where they begin; tilts reach 3 degrees.
std::vector<RigidMotion> raster_path(double speed_mm_s = 45);    ///< three lines, turning by 8 degrees
std::vector<RigidMotion> free_path(double speed_mm_s = 45);      ///< by hand, turning by 25 degrees
std::vector<RigidMotion> straight_path(double speed_mm_s = 45);  ///< once along the middle

/// What is wrong with a map, once it is aligned with the relief.
struct MapErrors {
  double rms_mm = 0;         ///< from what the skin shows
  double relief_rms_mm = 0;  ///< from the relief itself
  double stated_mm = 0;      ///< RMS of the stated errors
  double held = 0;           ///< part of the pixels within 1.96 stated errors
  double seam_mm = 0;        ///< largest jump of the error between neighbouring strips of 0.5 x 4 mm
  double covered = 0;        ///< part of 58 x 18 mm
};
/// `first`: true motion of the map's first key frame.
MapErrors errors_of(const FusedMap& map, const Relief& relief, double skin_mm, const RigidMotion& first);

}  // namespace palpate::scenes
