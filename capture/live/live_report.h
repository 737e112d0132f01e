// Report at the end of a live session, as text and as JSON.
#pragma once

#include <string>
#include <vector>

#include "capture/live/live_options.h"
#include "capture/live/recorder.h"
#include "engine/base/json.h"

namespace palpate {

std::string describe(const LiveReport& report, const std::vector<Recording::Written>& sessions);
json::Value to_json(const LiveReport& report, const std::vector<Recording::Written>& sessions);

/// The first error of a session that ended early; empty where all are whole.
std::string recording_error(const std::vector<Recording::Written>& sessions);

}  // namespace palpate
