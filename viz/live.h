// The live session: capture, engine and display, each at its own pace, meeting in one-place mailboxes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/source.h"
#include "engine/frame.h"
#include "engine/pipeline.h"
#include "engine/sensor.h"
#include "viz/view_state.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::viz {

struct LiveOptions {
  std::string title = "palpate";
  uint32_t width = 1280;  ///< px of the window
  uint32_t height = 720;  ///< px
  Vsync vsync = Vsync::On;
  uint64_t max_frames = 0;    ///< ends after so many captured frames; 0: no limit
  double max_seconds = 0;     ///< ends after so long; 0: no limit
  bool loop = false;          ///< starts a recording again at its end
  bool close_at_end = false;  ///< false: the last picture stays until the window is closed
  double rate_Hz = 0;         ///< pace of the source in live view; 0: its own (10 where it has none)
  std::filesystem::path screenshots = ".";      ///< folder of palpate-NNNN.png
  std::function<bool()> interrupted;            ///< polled; true ends the session cleanly (Ctrl-C)
  std::function<void(const Touch&)> on_result;  ///< every measured frame, in order, on the engine's thread
};

/// What a session did.
struct LiveReport {
  uint64_t captured = 0;
  uint64_t processed = 0;
  uint64_t shown = 0;
  uint64_t dropped_before_engine = 0;
  uint64_t dropped_before_display = 0;
  double seconds = 0;  ///< from the first frame captured to the end
  double shown_per_s = 0;
  double latency_median_ms = 0;  ///< from delivery of the frame by its source to its presentation, host clock
  double latency_p95_ms = 0;
  double draw_median_ms = 0;
  uint32_t mesh_columns = 0;  ///< of the last picture
  bool interrupted = false;
};

/// Opens the window and shows the source until its end, the limits, Ctrl-C or the person closes it. `open` is
/// called on this thread first, and again at each start of a loop. Main thread only. Throws Error, also what
/// capture or engine threw.
LiveReport run_live(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                    const Sensor& sensor, const Frame& background, PipelineOptions pipeline_options,
                    const LiveOptions& options);

}  // namespace palpate::viz
