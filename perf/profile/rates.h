// Fast cameras: every frame to numbers.
#pragma once

#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"

namespace palpate::gpu {
struct ContextOptions;
}

namespace palpate::perf {

/// A waveguide and a colour gel of 320 x 240 and a gel of 640 x 480, simulated beforehand into memory, with
/// force, slip and contacts, and with their surfaces, at 120 to 1000 frames/s; then as fast as it goes.
/// Nothing is drawn or recorded. Into `profile.rates`; what there is no time for is skipped.
void measure_rates(const gpu::ContextOptions& device, double seconds, const Watch& watch, Profile& profile);

}  // namespace palpate::perf
