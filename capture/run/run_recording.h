// Run of a source through a pipeline, from its first frame to its last; no frame is dropped.
#pragma once

#include <cstdint>
#include <functional>

#include "capture/source.h"
#include "palpate/pipeline.h"

namespace palpate {

/// Every frame of `source` through `pipeline`, in order, each slot in use; `on_result` is called for each in
/// order, with the frame it came from. Stops after `limit` frames (0: none),
/// before frame number `end`, or once `stop` (may be empty) says so. Returns the number of
/// frames.
uint64_t run_recording(Source& source, Pipeline& pipeline, uint64_t limit, const std::function<bool()>& stop,
                       const std::function<void(const Result&, const Frame&)>& on_result,
                       uint64_t end = UINT64_MAX);

}  // namespace palpate
