// Timing of the whole frame and each of its stages, from small frames to the largest.
#pragma once

#include <string>
#include <vector>

#include "palpate/sensor.h"
#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"

namespace palpate::gpu {
struct ContextOptions;
}

namespace palpate::perf {

struct FrameSize {
  uint32_t width_px = 0;
  uint32_t height_px = 0;
  bool operator==(const FrameSize&) const = default;
};

/// 160 x 120 to 8192 x 8192, or the three smallest.
std::vector<FrameSize> default_sizes(bool quick);
/// "640x480". Throws Error(Failure::Usage).
FrameSize parse_size(const std::string& text);

/// Measures every size for every reading, smallest first, within about `seconds`; into `profile`: sizes,
/// growth, and what was skipped for time or memory.
void measure_sizes(const gpu::ContextOptions& device, const std::vector<FrameSize>& sizes,
                   const std::vector<SurfaceReading>& readings, double seconds, const Watch& watch,
                   Profile& profile);

}  // namespace palpate::perf
