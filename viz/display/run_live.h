// The live session in a window.
#pragma once

#include "capture/live/live.h"
#include "viz/display/window_run.h"

namespace palpate::viz {

/// Opens the window and shows the source until its end, the limits, Ctrl-C or the person closes it. `open` is
/// called on this thread first, and again at each start of a loop. Main thread only. Throws Error, also what
/// capture or engine threw.
LiveReport run_live(gpu::Context& context, const OpenSource& open, MeasuredRun run, LiveOptions options,
                    WindowRun shown);

}  // namespace palpate::viz
