// Latency of a measurement and its picture when a camera sets the pace.
#pragma once

#include <functional>
#include <vector>

#include "palpate/pipeline.h"
#include "perf/profile/profile.h"
#include "perf/profile/sampling.h"
#include "perf/profile/sizes.h"

namespace palpate::perf {

/// Draws a result without a window.
using DrawResult = std::function<void(const Frame& frame, const Result& result)>;
/// Made once a size.
using MakeDrawer = std::function<DrawResult(gpu::Context& context, const Sensor& sensor)>;

/// A simulated camera at 30 and at 60 frames/s with capture, engine and off-screen drawing in threads of
/// their own, as in the live window; into `profile.live`. Of each size the reading `shading`.
void measure_live(const gpu::ContextOptions& device, const std::vector<FrameSize>& sizes,
                  const MakeDrawer& drawer, double seconds, const Watch& watch, Profile& profile);

}  // namespace palpate::perf
