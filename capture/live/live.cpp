#include "capture/live/live.h"

#include <atomic>
#include <exception>
#include <thread>
#include <utility>

#include "capture/live/capture_thread.h"
#include "capture/live/engine_thread.h"
#include "capture/live/session.h"
#include "capture/series.h"
#include "engine/base/trace.h"
#include "engine/gpu/context.h"
#include "engine/pipeline/pipeline_access.h"
#include "palpate/error.h"

namespace palpate {
namespace {

using std::chrono::milliseconds;

/// A part of the session in a thread of its own; ended and joined at the latest with the object.
class SessionThread {
 public:
  /// An exception of `work` ends the session, but for a lost device. `done` is called in any case.
  SessionThread(LiveSession& session, const char* name, const std::function<void()>& work,
                const std::function<void()>& done)
      : session_(session), thread_([this, name, work, done] {
          name_trace_thread(name);
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
    while (!session_.ending() && !session_.to_display.finished()) {
      if (options_.interrupted && options_.interrupted()) report.interrupted = true;
      const bool over = options_.max_seconds > 0 && start_ns != 0 &&
                        1e-9 * static_cast<double>(monotonic_ns() - start_ns) >= options_.max_seconds;
      if (report.interrupted || over) break;
      auto newest = session_.to_display.take(milliseconds(20));
      if (options_.on_progress) options_.on_progress(session_.captured);
      if (!newest) continue;
      if (start_ns == 0) start_ns = newest->captured->frame.delivered_ns;
      if (options_.on_newest) options_.on_newest(newest->captured->frame, newest->result);
      if (options_.draw) {
        const TraceSpan span("write");
        options_.draw(newest->captured->frame, newest->result);
        newest->times.shown_ns = monotonic_ns();
      }
      end_ns = monotonic_ns();
      latency_.add(newest->times);
      session_.give_back(*newest);
    }
    report.seconds = 1e-9 * static_cast<double>(end_ns - start_ns);
    return report;
  }

 private:
  LiveSession& session_;
  const LiveOptions& options_;
  LatencyLog& latency_;
};

/// Drops results of a device that was lost; their frames return to capture. How many there were.
uint64_t drop_results(LiveSession& session, LatencyLog& latency) {
  uint64_t dropped = 0;
  for (; auto unseen = session.to_display.take(milliseconds(0)); ++dropped) {
    latency.add(unseen->times);
    session.give_back(*unseen);
  }
  return dropped;
}

/// Adds the report of a viewer to that of the viewer it replaced on another device.
void add_to(LiveReport& sum, const LiveReport& next) {
  const uint64_t shown = sum.shown + next.shown;
  const uint32_t losses = sum.device_losses;
  const uint64_t dropped = sum.dropped_before_display;
  const double seconds = sum.seconds + next.seconds;
  sum = next;
  sum.dropped_before_display = dropped;
  sum.shown = shown;
  sum.seconds = seconds;
  sum.device_losses = losses;
  sum.shown_per_s = seconds > 0 ? static_cast<double>(shown) / seconds : 0;
}

/// Measures and shows until the viewer ends or the device is lost.
void run_on_device(Pipeline& pipeline, LiveSession& session, const LiveOptions& options,
                   const MakeViewer& make_viewer, LatencyLog& latency, Pending& pending, LiveReport& report) {
  const std::unique_ptr<LiveViewer> viewer = make_viewer(session, latency, pipeline);
  SessionThread engine(
      session, "engine", [&] { LiveEngine(session, pipeline, options, latency, pending).run(); },
      [&] {
        if (!session.device_lost) session.to_display.close();
      });
  add_to(report, viewer->run());
  if (session.device_lost) {
    engine.join();
    report.dropped_before_display += drop_results(session, latency);
    return;
  }
  engine.stop();
  session.rethrow();
  report.flaws = PipelineAccess::flaws(pipeline).describe();
  if (options.presses) {
    report.presses = options.presses->finish();
    viewer->finish_presses();
  }
}

/// Captures while `measure` measures and shows, with the maker of viewers that it is given.
template <typename Measure>
LiveReport run_captured(LiveSession& session, const OpenSource& open, const LiveOptions& options,
                        const MakeViewer& make_viewer, const Measure& measure) {
  session.transport.speed = options.speed;
  session.use(open());
  LatencyLog latency(options.latency_file, options.on_times);
  LiveReport report;
  std::atomic<bool> measuring = false;
  const MakeViewer make = [&](LiveSession& of, LatencyLog& log, const Pipeline& pipeline) {
    std::unique_ptr<LiveViewer> viewer = make_viewer(of, log, pipeline);
    measuring = true;
    return viewer;
  };
  {
    SessionThread capture(
        session, "capture",
        [&] {
          // A recording begins when it can be measured; a camera's frames are recorded from the first one on.
          while (!measuring && !session.stop && !session.source()->live())
            std::this_thread::sleep_for(milliseconds(1));
          try {
            LiveCapture(session, open, options).run();
          } catch (const Error& error) {
            if (error.failure() != Failure::Input) throw;
            session.fail(std::current_exception());  // the frames before it are good
          }
        },
        [&] { session.to_engine.close(); });
    measure(make, latency, report);
  }
  session.rethrow();
  latency.close();
  report.captured = session.captured;
  report.processed = session.processed;
  report.dropped_before_engine = session.to_engine.displaced() + session.passed_over;
  report.dropped_before_display += session.to_display.displaced();
  if (report.processed > 0)
    report.copies_per_frame = static_cast<double>(session.copies) / static_cast<double>(report.processed);
  report.camera = session.source()->counts();
  report.warning = session.source()->warning();
  report.to_measured = latency.to_measured();
  report.to_shown = latency.to_shown();
  report.latency_from_exposure = latency.from_exposure();
  return report;
}

/// Frames that the device has measured.
uint64_t measured(const LiveOptions& options, const LiveSession& session) {
  return options.measured_on_device ? options.measured_on_device() : session.processed.load();
}

MakeViewer no_window(const LiveOptions& options) {
  return [&options](LiveSession& session, LatencyLog& latency, const Pipeline&) {
    return std::make_unique<NoWindow>(session, options, latency);
  };
}

}  // namespace

LiveReport run_session(LiveSession& session, gpu::Context& context, const OpenSource& open,
                       const MeasuredRun& run, const LiveOptions& options, const MakeViewer& make_viewer) {
  return run_captured(session, open, options, make_viewer,
                      [&](const MakeViewer& make, LatencyLog& latency, LiveReport& report) {
                        gpu::Context* device = &context;
                        const Sensor sensor = for_rectified_frames(run.sensor);
                        Pending pending;
                        uint64_t measured_before = 0;
                        for (;;) {
                          {
                            Pipeline pipeline(*device, sensor, session.source()->format(), run.pipeline);
                            pipeline.set_background(run.background);
                            if (run.pipeline.separate)
                              look_ahead(options.input, run.sensor, pipeline,
                                         [&session] { return session.stop.load(); });
                            run_on_device(pipeline, session, options, make, latency, pending, report);
                          }
                          const std::optional<DeviceLost> lost = session.take_device_error();
                          if (!lost || report.interrupted) break;
                          // A device that measures nothing before it is lost again is given up.
                          const bool hopeless = measured(options, session) == measured_before;
                          const bool over = pending.empty() && session.to_engine.finished();
                          if (!options.outlive_device || hopeless || over) throw DeviceLost(*lost);
                          measured_before = measured(options, session);
                          report.device_losses = ++session.device_losses;
                          if (options.on_device_lost) options.on_device_lost(*lost);
                          if (options.reopen_device)
                            device = &options.reopen_device(*device);
                          else
                            device->reopen();
                        }
                      });
}

LiveReport run_without_window(gpu::Context& context, const OpenSource& open, const MeasuredRun& run,
                              const LiveOptions& options) {
  LiveSession session(Patience(options.patience_s, options.input));
  return run_without_window(session, context, open, run, options);
}

LiveReport run_without_window(LiveSession& session, gpu::Context& context, const OpenSource& open,
                              const MeasuredRun& run, const LiveOptions& options) {
  return run_session(session, context, open, run, options, no_window(options));
}

LiveReport run_without_window(Pipeline& pipeline, const OpenSource& open, const LiveOptions& options) {
  LiveSession session(Patience(options.patience_s, options.input));
  return run_captured(session, open, options, no_window(options),
                      [&](const MakeViewer& make, LatencyLog& latency, LiveReport& report) {
                        Pending pending;
                        run_on_device(pipeline, session, options, make, latency, pending, report);
                        if (const std::optional<DeviceLost> lost = session.take_device_error())
                          throw DeviceLost(*lost);
                      });
}

}  // namespace palpate
