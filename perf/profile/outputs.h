// Cost of a frame when outputs that the scene does not need are left out.
#pragma once

#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"
#include "perf/profile/sizes.h"

namespace palpate::perf {

/// All choices of outputs and readings at one size, in turn, each beside the full frame of its reading; into
/// `profile.outputs`.
void measure_outputs(const gpu::ContextOptions& device, const FrameSize& size, double seconds,
                     const Watch& watch, Profile& profile);

}  // namespace palpate::perf
