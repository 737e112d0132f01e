// Memory bandwidth of the device when it does nothing else, and the choice between its clock and the host's.
#pragma once

#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"

namespace palpate::gpu {
struct ContextOptions;
}

namespace palpate::perf {

/// Copies and streams buffers from 1 MiB up to `largest_bytes` (less where the device's limits or memory are
/// smaller), for about `seconds`. GPU timestamps are trusted where, for the largest copy, they agree with the
/// host's clock within a tenth.
Ceiling measure_ceiling(const gpu::ContextOptions& device, uint64_t largest_bytes, double seconds,
                        const Watch& watch);

}  // namespace palpate::perf
