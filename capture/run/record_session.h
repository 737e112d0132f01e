// Recording of a source into a session folder, with the measurements of every frame.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "capture/live/recorder.h"
#include "capture/mcap/sink.h"
#include "capture/run/run_settings.h"
#include "capture/run/run_watch.h"
#include "capture/session/session.h"
#include "palpate/pipeline.h"

namespace palpate {
namespace gpu {
class Context;
}

/// Data that every session of this input keeps with its frames.
SessionInfo session_info(const MeasuredInput& input, const Source& source, const Frame& background,
                         const PipelineOptions& pipeline, const gpu::Context& context);

struct RecordRequest : RunSettings {
  MeasuredInput found;  ///< find_input() of the settings
  std::filesystem::path folder;
  bool mcap = false;                                      ///< recording.mcap in the session's folder too
  bool outlive_device = true;                             ///< as LiveOptions has it
  std::function<void(const DeviceLost&)> on_device_lost;  ///< likewise
  /// Factory of the monitor of presses of a block of tissue, from the untouched image; may be null, and may
  /// return null.
  std::function<std::unique_ptr<PressMonitor>(const Frame& background)> watch;
  /// Called with the run's options before it starts, for whoever looks on; may be null.
  std::function<void(LiveOptions&, Recording&, const PipelineOptions&)> attach;
};

struct RecordOutcome {
  LiveReport live;
  Recording::Written session;      ///< its status has the error that ended it early
  std::optional<McapStatus> mcap;  ///< its error ends the run too
};

/// Measures and records each frame. A recording or a scene waits for engine and file, unless it is played at
/// a rate; of a camera a frame that does not fit in time is dropped and counted. A recording that fails ends
/// the run. `context`: made once all that needs no device is there. Throws Error(Failure::Output) where the
/// folder holds a session already.
RecordOutcome record_session(const std::function<gpu::Context&()>& context, const RecordRequest& request,
                             const RunWatch& watch);

}  // namespace palpate
