// A hidden lump from the finite elements themselves: the lump whose block would have answered as the reading
// does (theory S12). Slow and without training: what the network is measured against.
#pragma once

#include "engine/lump/fem_inverse/response.h"

namespace palpate {

struct DirectInversionOptions {
  LumpResponseOptions model;
  /// Where a search starts; its shape and axis stay as given.
  struct Start {
    LumpCase::Lump lump;
    double odds = 1;  ///< how likely this shape is before it is fitted, beside the others
  };
  /// Each is searched from: shapes that fit as well widen the best one's intervals. Empty: a sphere at the
  /// place of the bump.
  std::vector<Start> starts;
  uint32_t most_rounds = 16;
  double gauge_share = 0.001;   ///< standard deviation of a force of the reading
  double young_share = 0.01;    ///< of the tissue's modulus
  double model_share = 0.0015;  ///< of the reading's peak, what the elements' own values are off
  /// Of a bump's height at each place, what elements are off by: once for the whole bump, and once in common
  /// with neighbours within some 3 mm. The same at all loads, and what of it changes from the first load to
  /// the last. As 64 and 40 cells that do not follow a lump differ from those that do.
  double bump_share = 0.008, bump_change_share = 0.003;
};

/// Gauss and Newton's search with damping (Levenberg and Marquardt) for size, depth, stiffness ratio and
/// place of the lump; forces and the tissue's modulus may err by their shares. Intervals from the curvature
/// at the end, widened where the reading fits worse than its noise; where the ratio is little determined,
/// from its likelihood's profile. StiffnessOpen, NoLump, Unusable as LumpVerdict says; NoLump where the lump
/// gains less than chance does in one of 100 readings. One to four minutes of one processor for four loads
/// and each start, up to ten where the ratio is open or there is no lump. Throws Error(Failure::Usage) where
/// the reading's parts do not fit together.
LumpEstimate invert_directly(const LumpReading& reading, const DirectInversionOptions& options = {});

}  // namespace palpate
