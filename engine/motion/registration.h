// Registration: the rigid motion which brings the surface of one frame onto that of another.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>

#include "engine/motion/contact_surface.h"
#include "engine/motion/freedom.h"
#include "engine/motion/pixel_sums.h"
#include "engine/motion/rigid_motion.h"

namespace palpate {

struct RegistrationOptions {
  uint32_t finest_level = 0;  ///< the last level of ContactSurface that is used
  int most_steps = 12;        ///< on each level
  /// A search near the start that leaves no more than this is taken without looking farther.
  double enough_residual_mm = 0;
  /// Standard error of the pad's slopes by calibration (a photometric sensor's normal_sd, less the noise of a
  /// frame in it). It stays with the pad: slopes below it determine nothing, and what a way over the pad
  /// changes of it is in the covariance.
  double pad_slope_sd = 0;
  /// Way over which that error goes along with itself (a Gaussian's deviation), mm; 0: not known, all from 3
  /// to 48 px are taken for alike.
  double pad_reach_mm = 0;
  /// Half the variance of what the skin smooths a depth by, mm2, which a surface that tilts is not the same
  /// after. The motion is corrected for it, and for what ContactSurface smooths by.
  double skin_smoothing_mm2 = 0;
  FreedomOptions freedom;

  /// Slopes below this are the pad's own.
  double least_slope() const { return std::max(freedom.least_slope, pad_slope_sd); }
};

struct Registration {
  /// Of the object, from the key frame to now, in the pad's axes. Of those that what is unknown leaves open,
  /// the one that turns least (Freedom::least_turn): a ball's is its centre's shift.
  RigidMotion motion;
  /// Where the middle of the key frame's contact is now.
  Eigen::Vector3d at_mm = Eigen::Vector3d::Zero();
  /// Of the small motion that is missing (truth = motion_about(at_mm, twist) motion), mm and radians; 0 along
  /// what is unknown.
  Matrix6d covariance = Matrix6d::Zero();
  /// Of that covariance, what both maps' levels make.
  Matrix6d of_levels = Matrix6d::Zero();
  /// What a smoothing adds to the motion that is found, for each mm2 of half its variance, seen at at_mm.
  Vector6d by_smoothing = Vector6d::Zero();
  Freedom freedom;         ///< seen at at_mm
  double residual_mm = 0;  ///< of depth, as a standard deviation that strangers do not raise
  double overlap = 0;      ///< pixels compared, of the smaller contact's
  double fitting = 0;      ///< of those, the part that fits (Tukey's weight is not 0)
  /// Part of the slopes' squares along the pad that the two frames do not share, over reaches of 3 px and
  /// more, 0 to 1; 0 where slopes are too small to tell. Near 1 where the search ended on a wrong wave of a
  /// texture.
  double disagreement = 0;
  int steps = 0;           ///< on all levels
  bool converged = false;  ///< the last step on the finest level was less than a hundredth of a pixel
  /// Enough pixels were compared for a motion at all; nothing else is set where not.
  bool found = false;
};

/// Gauss-Newton on the depth between the moved surface and the key frame's, by Tukey's weights about a scale
/// from the median, from coarse to fine. Its rows are the mean of both frames' slopes (Benhimane and Malis,
/// 2004), its information is the product of one frame's with the other's, which noise leaves as it is.
/// Normals are no residuals of their own: they are differences of the same depths, and would count their
/// noise twice. `start`: of the motion. Both surfaces have the same pitch.
Registration register_surface(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start,
                              const RegistrationOptions& options = {});
/// The same with others' sums.
Registration register_surface(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start,
                              const RegistrationOptions& options, PixelSums& sums);

}  // namespace palpate
