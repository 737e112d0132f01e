// The live session in a window.
#pragma once

#include <functional>
#include <memory>

#include "capture/live/live_options.h"
#include "palpate/sensor.h"
#include "viz/display/window_run.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::viz {

/// Opens the window and shows the source until its end, the limits, Ctrl-C or the person closes it. `open` is
/// called on this thread first, and again at each start of a loop. Main thread only. Throws Error, also what
/// capture or engine threw.
LiveReport run_live(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                    const Sensor& sensor, const Frame& background, PipelineOptions pipeline_options,
                    LiveOptions options, WindowRun shown);

}  // namespace palpate::viz
