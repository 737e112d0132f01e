#include "capture/live/live.h"

#include <exception>
#include <thread>
#include <utility>

#include "capture/live/capture_thread.h"
#include "capture/live/recorder.h"
#include "capture/live/session.h"
#include "engine/gpu/context.h"

namespace palpate::viz {
namespace {

using std::chrono::milliseconds;

/// Measures what capture delivers. `next`: the frame in hand, which a lost device leaves unmeasured.
void engine_loop(LiveSession& session, Pipeline& pipeline, const LiveOptions& options, LatencyLog& latency,
                 CapturedPtr& next) {
  uint64_t gaps = next ? next->gaps : 0;
  if (next) next->frame.after_gap = true;
  while (!session.stop && !session.device_lost && (next || !session.to_engine.finished())) {
    if (!next) {
      auto captured = session.to_engine.take(milliseconds(20));
      if (!captured) continue;
      next = std::move(*captured);
    }
    Frame& frame = next->frame;
    // Of several frames of which only the last got here, any may have come after a gap.
    if (next->gaps != gaps) frame.after_gap = true;
    gaps = next->gaps;
    const bool leased = frame.leased != nullptr;
    while (!pipeline.submit(frame)) {
      if (session.stop || session.device_lost) return;
      std::this_thread::sleep_for(milliseconds(1));  // every slot is held by the display
    }
    Result result = pipeline.wait().value();
    const FrameTimes times(frame, monotonic_ns());
    ++session.processed;
    // A frame that is not leased was copied, or made, by its source.
    session.copies += result.copies + (leased ? 0 : 1);
    if (options.recording) options.recording->measured(result.touch, times.measured_ns);
    if (options.presses && result.touch.picture == PictureFault::None)
      options.presses->add(frame, result.touch);
    if (options.on_result) options.on_result(result.touch);
    if (auto displaced = session.to_display.put({std::move(next), std::move(result), times})) {
      latency.add(displaced->times);
      session.frames.put(std::move(displaced->captured));
    }
  }
}

/// A part of the session in a thread of its own; ended and joined at the latest with the object.
class SessionThread {
 public:
  /// What `work` throws ends the session, but for a lost device. `done`: whatever became of it.
  SessionThread(LiveSession& session, const std::function<void()>& work, const std::function<void()>& done)
      : session_(session), thread_([this, work, done] {
          try {
            work();
          } catch (const DeviceLost& error) {
            session_.lose_device(error);
          } catch (...) {
            session_.fail(std::current_exception());
            session_.stop = true;
          }
          done();
        }) {}
  ~SessionThread() {
    if (thread_.joinable()) stop();
  }
  SessionThread(const SessionThread&) = delete;
  SessionThread& operator=(const SessionThread&) = delete;

  void stop() {
    session_.stop = true;
    join();
  }
  /// For a thread that ends by itself.
  void join() {
    if (thread_.joinable()) thread_.join();
  }

 private:
  LiveSession& session_;
  std::thread thread_;
};

/// Handling of results when there is no display.
class NoWindow : public LiveViewer {
 public:
  NoWindow(LiveSession& session, const LiveOptions& options, LatencyLog& latency)
      : session_(session), options_(options), latency_(latency) {}

  LiveReport run() override {
    LiveReport report;
    int64_t start_ns = 0, end_ns = 0;
    while (!session_.stop && !session_.device_lost && !session_.to_display.finished()) {
      if (options_.interrupted && options_.interrupted()) report.interrupted = true;
      const bool over = options_.max_seconds > 0 && start_ns != 0 &&
                        1e-9 * static_cast<double>(monotonic_ns() - start_ns) >= options_.max_seconds;
      if (report.interrupted || over) break;
      auto newest = session_.to_display.take(milliseconds(20));
      if (options_.on_progress) options_.on_progress(session_.captured);
      if (!newest) continue;
      if (start_ns == 0) start_ns = newest->captured->frame.delivered_ns;
      if (options_.draw) {
        options_.draw(newest->captured->frame, newest->result);
        newest->times.shown_ns = monotonic_ns();
      }
      end_ns = monotonic_ns();
      latency_.add(newest->times);
      session_.frames.put(std::move(newest->captured));
    }
    report.seconds = 1e-9 * static_cast<double>(end_ns - start_ns);
    return report;
  }

 private:
  LiveSession& session_;
  const LiveOptions& options_;
  LatencyLog& latency_;
};

/// Drops results of a device that was lost; their frames return to capture.
void drop_results(LiveSession& session, LatencyLog& latency) {
  while (auto unseen = session.to_display.take(milliseconds(0))) {
    latency.add(unseen->times);
    session.frames.put(std::move(unseen->captured));
  }
}

/// Adds the report of a viewer to that of the viewer it replaced on another device.
void add_to(LiveReport& sum, const LiveReport& next) {
  const uint64_t shown = sum.shown + next.shown;
  const uint32_t losses = sum.device_losses;
  const double seconds = sum.seconds + next.seconds;
  sum = next;
  sum.shown = shown;
  sum.seconds = seconds;
  sum.device_losses = losses;
  sum.shown_per_s = seconds > 0 ? static_cast<double>(shown) / seconds : 0;
}

/// What is measured and how, the same on every device.
struct MeasuredRun {
  const Sensor& sensor;
  const Frame& background;
  const PipelineOptions& pipeline;
  const LiveOptions& options;
  const MakeViewer& make_viewer;
};

/// Measures and shows on the context's device until the viewer ends or the device is lost.
void run_on_device(gpu::Context& context, LiveSession& session, const MeasuredRun& run, LatencyLog& latency,
                   CapturedPtr& next, LiveReport& report) {
  Pipeline pipeline(context, for_rectified_frames(run.sensor), session.source()->format(), run.pipeline);
  pipeline.set_background(run.background);
  const std::unique_ptr<LiveViewer> viewer = run.make_viewer(session, latency);
  SessionThread engine(
      session, [&] { engine_loop(session, pipeline, run.options, latency, next); },
      [&] {
        if (!session.device_lost) session.to_display.close();
      });
  add_to(report, viewer->run());
  if (session.device_lost) {
    engine.join();
    return drop_results(session, latency);
  }
  engine.stop();
  session.rethrow();
  if (run.options.presses) {
    report.presses = run.options.presses->finish();
    viewer->finish_presses();
  }
}

}  // namespace

LiveReport run_session(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                       const Sensor& sensor, const Frame& background, const PipelineOptions& pipeline_options,
                       const LiveOptions& options, const MakeViewer& make_viewer) {
  const MeasuredRun run{sensor, background, pipeline_options, options, make_viewer};
  LiveSession session;
  session.transport.speed = options.speed;
  session.use(open());
  LatencyLog latency(options.latency_file, options.on_times);
  LiveReport report;
  CapturedPtr next;
  {
    SessionThread capture(
        session, [&] { LiveCapture(session, open, options).run(); }, [&] { session.to_engine.close(); });
    uint64_t processed_before = 0;
    for (;;) {
      run_on_device(context, session, run, latency, next, report);
      const std::optional<DeviceLost> lost = session.take_device_error();
      if (!lost || report.interrupted) break;
      // A device that measures nothing before it is lost again is given up.
      const bool hopeless = session.processed == processed_before;
      if (hopeless || (!next && session.to_engine.finished())) throw DeviceLost(*lost);
      processed_before = session.processed;
      report.device_losses = ++session.device_losses;
      if (options.on_device_lost) options.on_device_lost(*lost);
      if (options.reopen_device) {
        options.reopen_device(context);
      } else {
        context.reopen();
      }
    }
  }
  session.rethrow();
  latency.close();
  report.captured = session.captured;
  report.processed = session.processed;
  report.dropped_before_engine = session.to_engine.displaced() + session.passed_over;
  report.dropped_before_display = session.to_display.displaced();
  if (report.processed > 0)
    report.copies_per_frame = static_cast<double>(session.copies) / static_cast<double>(report.processed);
  report.camera = session.source()->counts();
  report.warning = session.source()->warning();
  report.to_measured = latency.to_measured();
  report.to_shown = latency.to_shown();
  report.latency_from_exposure = latency.from_exposure();
  return report;
}

LiveReport run_without_window(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                              const Sensor& sensor, const Frame& background,
                              const PipelineOptions& pipeline_options, const LiveOptions& options) {
  return run_session(context, open, sensor, background, pipeline_options, options,
                     [&](LiveSession& session, LatencyLog& latency) {
                       return std::make_unique<NoWindow>(session, options, latency);
                     });
}

}  // namespace palpate::viz
