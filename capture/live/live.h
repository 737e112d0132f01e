// The live session: capture, engine and viewer, each at its own pace, meeting in one-place mailboxes. The one
// loop behind the window, `record`, `process` and Python's streams.
#pragma once

#include <functional>
#include <memory>

#include "capture/live/live_options.h"
#include "palpate/sensor.h"

namespace palpate {

struct LiveSession;

/// Receiver of measured frames on the caller's thread: a window, files, or whoever asks for the next.
class LiveViewer {
 public:
  virtual ~LiveViewer() = default;
  /// Until the session ends or the person closes it; rethrows what the other threads threw.
  virtual LiveReport run() = 0;
  /// Results of presses since then, once no more frames come.
  virtual void finish_presses() {}
};
/// Session, log and pipeline outlive the viewer.
using MakeViewer = std::function<std::unique_ptr<LiveViewer>(LiveSession& session, LatencyLog& latency,
                                                             const Pipeline& pipeline)>;

/// Sensor and options of a measurement, the same on every device.
struct MeasuredRun {
  const Sensor& sensor;
  const Frame& background;
  PipelineOptions pipeline;
};

/// Measures the source until its end, the limits, Ctrl-C or the viewer ends. `open` is called on this thread
/// first, and again at each start of a loop. A device that is lost is opened anew, with a new viewer, while
/// capture and recording go on. A recording that is damaged at frame n has its n frames measured and shown
/// first. Throws Error, also what capture or engine threw.
LiveReport run_session(LiveSession& session, gpu::Context& context, const OpenSource& open,
                       const MeasuredRun& run, const LiveOptions& options, const MakeViewer& make_viewer);

/// The same without a window: capture, measurement and recording, and each result to LiveOptions::draw.
LiveReport run_without_window(gpu::Context& context, const OpenSource& open, const MeasuredRun& run,
                              const LiveOptions& options);

/// On a session that the caller watches, and may end or tell of a lost device, meanwhile.
LiveReport run_without_window(LiveSession& session, gpu::Context& context, const OpenSource& open,
                              const MeasuredRun& run, const LiveOptions& options);

/// On a pipeline with its background; a lost device is the caller's.
LiveReport run_without_window(Pipeline& pipeline, const OpenSource& open, const LiveOptions& options);

}  // namespace palpate
