// The live session: capture, engine and display, each at its own pace, meeting in one-place mailboxes.
#pragma once

#include <functional>
#include <memory>

#include "capture/live/live_options.h"
#include "palpate/sensor.h"

namespace palpate::gpu {
class Context;
}

namespace palpate::viz {

struct LiveSession;

/// Receiver of measured frames on the caller's thread: a window or its replacement.
class LiveViewer {
 public:
  virtual ~LiveViewer() = default;
  /// Until the session ends or the person closes it; rethrows what the other threads threw.
  virtual LiveReport run() = 0;
  /// Results of presses since then, once no more frames come.
  virtual void finish_presses() {}
};
/// The session and the log outlive the viewer.
using MakeViewer = std::function<std::unique_ptr<LiveViewer>(LiveSession& session, LatencyLog& latency)>;

/// Measures the source until its end, the limits, Ctrl-C or the viewer ends. `open` is called on this thread
/// first, and again at each start of a loop. A device that is lost is opened anew, with a new viewer, while
/// capture and recording go on; not where the window is the caller's. Throws Error, also what capture or
/// engine threw.
LiveReport run_session(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                       const Sensor& sensor, const Frame& background, const PipelineOptions& pipeline_options,
                       const LiveOptions& options, const MakeViewer& make_viewer);

/// The same without a window: capture, measurement and recording only.
LiveReport run_without_window(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                              const Sensor& sensor, const Frame& background,
                              const PipelineOptions& pipeline_options, const LiveOptions& options);

}  // namespace palpate::viz
