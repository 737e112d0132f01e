// A hidden lump from the finite elements themselves: the lump whose block would have answered as the reading
// does (theory S12). Slow and without training: what the network is measured against.
#pragma once

#include "engine/lump/lump_response.h"

namespace palpate {

struct DirectInversionOptions {
  LumpResponseOptions model;
  /// Where the search starts; the place of the bump where there is none. Shape and axis stay as given.
  std::optional<LumpCase::Lump> start;
  LumpShape shape = LumpShape::Sphere;  ///< where there is no start
  uint32_t most_rounds = 16;
  double gauge_share = 0.001;   ///< standard deviation of a force of the reading
  double young_share = 0.01;    ///< of the tissue's modulus
  double model_share = 0.0015;  ///< of the reading's peak, what the elements' own values are off
};

/// Gauss and Newton's search with damping (Levenberg and Marquardt) for size, depth, stiffness ratio and
/// place of the lump; forces and the tissue's modulus may err by their shares. Intervals from the curvature
/// at the end, widened where the reading fits worse than its noise. StiffnessOpen, NoLump, Unusable as
/// LumpVerdict says; NoLump where the lump gains less than chance does in one of 100 readings. About a
/// minute of one processor for four loads. Throws Error(Failure::Usage) where the reading's parts do not fit
/// together.
LumpEstimate invert_directly(const LumpReading& reading, const DirectInversionOptions& options = {});

}  // namespace palpate
