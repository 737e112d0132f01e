// Key memory: key frames that a track has passed, and whether a frame shows one of them again.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "engine/motion/registration.h"

namespace palpate {

/// A key frame, with the motion from the track's begin to it and that motion's error, seen at its middle: of
/// the last link, from the key frame before, and of all links before.
struct TrackKey {
  ContactSurface surface;
  RigidMotion motion;
  Matrix6d link = Matrix6d::Zero(), before = Matrix6d::Zero();
  /// Of all links, the twist that their turns about axes along the pad were, each about its own contact: what
  /// a depth's gain is wrong by makes all of them too small or too large alike.
  Vector6d tilted = Vector6d::Zero();
  /// Of all links, Registration::by_smoothing.
  Vector6d smoothed = Vector6d::Zero();
  double overlap = 0;  ///< of the last link
  Freedom freedom;
  double residual_mm = 0;  ///< of its first frame
  bool repeats = false;    ///< it fits itself elsewhere

  /// The object's point that is in the middle of the contact, where it was at the track's begin.
  Eigen::Vector3d place_mm() const { return motion.inverse() * surface.centroid_mm(); }
};

/// Covariance of errors that all links of a track share (TrackKey::tilted and smoothed), by the standard
/// errors of what they are by.
Matrix6d alike_error(const Vector6d& tilted, double gain_sd, const Vector6d& smoothed,
                     double smoothing_sd_mm2);

/// Where a frame is by what was tracked: the motion since the track began, its error seen at at_mm, and what
/// the frame leaves over where it fits.
struct TrackedMotion {
  RigidMotion motion;
  Matrix6d covariance = Matrix6d::Zero();
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  double residual_mm = 0;
};

struct MemoryOptions {
  double gain_sd = 0, skin_smoothing_sd_mm2 = 0;  ///< of PoseOptions
  size_t most = 24;  ///< key frames that are kept; of the two that show nearly the same the later one goes
  size_t most_pixels =
      2'000'000;  ///< of all of them, about 35 bytes each: 26 frames of 320 x 240, or 6 of 640 x 480
  // A frame is compared with the two surest key frames whose middle is no farther away than this, in radii,
  // and which are tilted by no more than this.
  double most_way = 0.5, most_tilt_deg = 25;
  // It shows one again where so much of it is shared and so much of that fits, what is left over is no more
  // than so many times what the frame and the key frame leave, and the slopes disagree by no more.
  double least_overlap = 0.5, least_fitting = 0.8, most_residual = 2, most_disagreement = 0.12;
  /// Square of the way between both motions in their standard errors: that of 99.9 % in six dimensions.
  double most_square = 22.5;
  /// Where another place within the motion's error leaves less than this times the residual, it is neither.
  double least_contrast = 1.4;
};

class KeyMemory {
 public:
  struct Return {
    const TrackKey* key;  ///< until the next keep() or clear()
    Registration found;   ///< from it to the frame
  };

  explicit KeyMemory(const MemoryOptions& options = {}) : options_(options) {}
  void clear() { keys_.clear(); }
  void keep(TrackKey key);
  size_t size() const { return keys_.size(); }

  /// The key frame that `now` shows again; nothing where none fits, where the surface does not determine all
  /// six directions, where the motion is no surer by it, or where another place fits as well.
  std::optional<Return> recognise(const ContactSurface& now, const TrackedMotion& tracked,
                                  const RegistrationOptions& registration, PixelSums& sums) const;

 private:
  std::vector<const TrackKey*> candidates(const ContactSurface& now, const TrackedMotion& tracked) const;
  bool fits(const Registration& found, double calm_mm) const;
  bool other_fits(const TrackKey& key, const ContactSurface& now, const TrackedMotion& tracked,
                  const Registration& found, const RegistrationOptions& registration, PixelSums& sums) const;

  MemoryOptions options_;
  std::vector<TrackKey> keys_;
};

}  // namespace palpate
