// A hidden lump from the finite elements themselves: the lump whose block would have answered as the
// observation does. Slow and without training: what the network is measured against.
#pragma once

#include "engine/lump/fem_inverse/options.h"

namespace palpate::lump {

/// Gauss and Newton's search with damping (Levenberg and Marquardt) for size, depth, stiffness ratio and
/// place of the lump; forces and the tissue's modulus may err by their shares. Intervals from the curvature
/// at the end, widened where the observation fits worse than its noise; where the ratio is little determined,
/// from its likelihood's profile. StiffnessOpen, NoLump, Unusable as Status says; NoLump where the lump
/// gains less than chance does in one of 100 observations. Four loads by elements alone: one to four minutes
/// of one processor for each start, up to ten where the ratio is open or there is no lump; led by an emulator
/// that knows the block: 2 to 20 s, up to 60 s of a lump off the middle. Past the options' limit of work
/// the other method's answer stands where there is no lump yet, Unusable without one; where there is, its
/// intervals are added; a reason says which. Throws Error(Failure::Usage) where the observation's parts do
/// not fit together, and Stopped.
Estimate invert_directly(const Observation& observation, const DirectInversionOptions& options = {});

}  // namespace palpate::lump
