// Two fingers live in a window, from their opening to their report.
#pragma once

#include <array>
#include <filesystem>

#include "capture/pair/pair_session.h"
#include "viz/commands/command.h"
#include "viz/commands/workflow/live_run.h"

namespace palpate {

struct LivePairRequest : PairRequest {
  std::filesystem::path recorded;  ///< folder of a recorded pair, in place of two inputs; empty: none
  bool record = false;             ///< from the start; needs `out`
  std::filesystem::path
      recordings;  ///< for sessions, snapshots and events where `out` is empty; may be empty
  ServeChoice serve;
  bool jsonl = false;  ///< each row goes to the terminal
  viz::WindowRun shown;
};

/// Main thread. Throws Error.
Report live_pair(gpu::Context& context, const LivePairRequest& request);

}  // namespace palpate
