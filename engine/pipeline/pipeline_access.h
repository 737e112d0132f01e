// The engine's own way into a public Pipeline and its results.
#pragma once

#include <vector>

#include "engine/gpu/commands.h"
#include "engine/gpu/context.h"
#include "engine/gpu/tuning.h"
#include "engine/measure/picture/pad_flaws.h"
#include "engine/pipeline/surface_map.h"
#include "palpate/pipeline.h"

namespace palpate {

struct PipelineAccess {
  /// A pipeline with these constants instead of those that were measured for the device. Throws Error.
  static Pipeline tuned(gpu::Context& context, const Sensor& sensor, const FrameFormat& format,
                        const PipelineOptions& options, const Tuning& tuning);
  /// Device time of each named stage of a finished frame; empty unless the context has timers on.
  static std::vector<gpu::ScopeTime> times(const Pipeline& pipeline, const Result& result);
  /// Memory traffic of each named stage with every frame.
  static std::vector<gpu::ScopeTraffic> traffic(const Pipeline& pipeline);
  static const SurfaceMap& surface(const Result& result);
  /// Flaws of the pad so far (PadFlaws).
  static FlawSummary flaws(const Pipeline& pipeline);
  /// Looks for flaws, and for the light of separate pictures, in one that is not measured; after
  /// set_background().
  static void look_ahead(Pipeline& pipeline, const Frame& frame);
};

}  // namespace palpate
