// Recording of a source into a session folder, with the measurements of every frame.
#pragma once

#include <cstdint>
#include <filesystem>

#include "capture/run/input.h"
#include "capture/run/run_watch.h"
#include "capture/session/session.h"
#include "palpate/pipeline.h"

namespace palpate {

/// Data that every session of this input keeps beside its frames.
SessionInfo session_info(const MeasuredInput& input, const Source& source, const Frame& background,
                         const PipelineOptions& pipeline, const gpu::Context& context);

/// Measures and records each frame, `frames` of them at most (0: all). Pictures without a rate are separate
/// presses unless they are `one_sequence`. A recording or a scene waits for the
/// file; of a camera a frame that does not fit in time is dropped and counted. Throws Error(Failure::Output)
/// where the folder holds a session already, or the recording fails.
SessionStatus record_session(gpu::Context& context, const MeasuredInput& input, PipelineOptions options,
                             bool one_sequence, uint64_t frames, const std::filesystem::path& folder,
                             const RunWatch& watch);

}  // namespace palpate
