// Point to plane: plain registration of two clouds by nearest points, the rival of engine/motion.
#pragma once

#include <Eigen/Core>

#include "engine/motion/contact_surface.h"
#include "engine/motion/rigid_motion.h"

namespace palpate::perf {

struct PointToPlane {
  RigidMotion motion;
  double overlap = 0;  ///< points that found a partner, of all
};

/// Each point of the present frame has the key frame's nearest one as its partner, at most three pixels away,
/// and is drawn to its plane (Chen and Medioni 1992; small_gicp's PLANE_ICP); all weigh alike. Neighbours are
/// looked for on the pixels' grid, which finds what a k-d tree does. At most 30 steps.
PointToPlane point_to_plane(const ContactSurface& key, const ContactSurface& now, const RigidMotion& start);

}  // namespace palpate::perf
