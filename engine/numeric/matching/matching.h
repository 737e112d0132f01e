// Which point is which: two point sets of which one is the other, bent, moved, noisy, and with points of no
// partner on both sides.
#pragma once

#include "engine/numeric/matching/match.h"

namespace palpate {

/// Neighbourhood structure (shape contexts; Belongie 2002, Zheng and Doermann 2006) and distance give soft
/// partners with nil on both sides, balanced so that no point is shared out twice (Sinkhorn); a smooth warp
/// (Gaussian kernels, an affine part free) follows them; their noise is estimated and anneals both. Several
/// starts; the posterior decides. The same answer for the same points, in any order of either set, to the
/// last bit. Few points that are not bent are matched by a map alone (unbent.h). `warped` is filled with the
/// best try even where the verdict is not Reliable. Throws Error(Failure::Input): fewer than axes + 1 points
/// on a side, axes that differ or are not 2 or 3, a coordinate that is not finite, all points of a side in
/// one place.
MatchResult match_points(const PointSet& from, const PointSet& to, const MatchOptions& options = {});

}  // namespace palpate
