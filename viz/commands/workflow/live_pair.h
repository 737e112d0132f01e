// Two fingers live in a window, from their opening to their report.
#pragma once

#include <array>
#include <filesystem>

#include "capture/pair/pair_session.h"
#include "viz/commands/command.h"
#include "viz/commands/workflow/live_run.h"

namespace palpate {

struct LivePairRequest : PairRequest {
  bool again = false;   ///< a recorded pair, with its own settings
  bool record = false;  ///< from the start; needs `out`
  std::filesystem::path
      recordings;  ///< for sessions, snapshots and events where `out` is empty; may be empty
  viz::WindowRun shown;
};

/// The fingers of a recorded pair, with its grip.json where `grip` is empty. Throws Error(Failure::Input).
LivePairRequest recorded_pair(const std::filesystem::path& folder, const LiveRunRequest& settings);

/// Main thread. Throws Error.
Report live_pair(gpu::Context& context, const LivePairRequest& request);

}  // namespace palpate
