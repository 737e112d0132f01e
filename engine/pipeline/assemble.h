// Assembly of a frame: what its stages found becomes a Touch, and the one place that decides each state.
#pragma once

#include <cstdint>
#include <optional>

#include "engine/pipeline/frame_parts.h"
#include "engine/pipeline/history.h"
#include "palpate/touch.h"

namespace palpate {

/// Facts about a frame before its stages have seen it.
struct FrameStamp {
  uint64_t sequence = 0;
  int64_t time_ns = 0;
  bool after_gap = false;  ///< the frames before are not the predecessors of this one
  PictureFault fault = PictureFault::None;
  bool repeated = false;
  std::optional<LightSummary> light = {};
};

/// State by the gravest of several faults, in the order of DepthFaults' members.
Validity validity_of(const DepthFaults& faults);
/// Likewise: light, convergence, the depth map's own fault (but that nothing touches), border, too deep,
/// covered.
Validity validity_of(const WrenchFaults& faults);

/// Fills `touch`, which has no values but memory that frames before it left: what the frame says by itself,
/// what follows from those before it, and the states. A spoilt picture says nothing: it is not followed, its
/// values are no numbers. Takes the lists of `parts`.
void assemble(FrameParts& parts, const FrameStamp& stamp, TouchHistory& history, Touch& touch);

}  // namespace palpate
