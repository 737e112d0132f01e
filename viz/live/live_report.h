// Report at the end of a live session, as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "capture/run/input.h"
#include "engine/base/json.h"
#include "viz/live/live_options.h"
#include "viz/live/recorder.h"

namespace palpate {

/// Data that every session of this input keeps beside its frames.
SessionInfo session_info(const MeasuredInput& input, const Source& source, const Frame& background,
                         const PipelineOptions& pipeline, const gpu::Context& context);

std::string describe(const viz::LiveReport& report, const std::vector<viz::Recording::Written>& sessions);
json::Value to_json(const viz::LiveReport& report, const std::vector<viz::Recording::Written>& sessions);

/// The first error of a session that ended early; empty where all are whole.
std::string recording_error(const std::vector<viz::Recording::Written>& sessions);

}  // namespace palpate
