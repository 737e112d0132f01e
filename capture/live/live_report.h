// Report at the end of a live session.
#pragma once

#include <string>
#include <vector>

#include "capture/live/live_options.h"
#include "capture/live/recorder.h"
#include "engine/base/facts.h"

namespace palpate {

Facts facts_of(const LiveReport& report, const std::vector<Recording::Written>& sessions);

/// The first error of a session that ended early; empty where all are whole.
std::string recording_error(const std::vector<Recording::Written>& sessions);

}  // namespace palpate
