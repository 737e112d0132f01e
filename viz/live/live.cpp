#include "viz/live/live.h"

#include <exception>
#include <thread>

#include "viz/live/capture_thread.h"
#include "viz/live/recorder.h"
#include "viz/live/session.h"

namespace palpate::viz {
namespace {

using std::chrono::milliseconds;

void engine_loop(LiveSession& session, Pipeline& pipeline, const LiveOptions& options, LatencyLog& latency) {
  uint64_t gaps = 0;
  while (!session.stop && !session.to_engine.finished()) {
    auto captured = session.to_engine.take(milliseconds(20));
    if (!captured) continue;
    Frame& frame = (*captured)->frame;
    // Of several frames of which only the last got here, any may have come after a gap.
    if ((*captured)->gaps != gaps) frame.after_gap = true;
    gaps = (*captured)->gaps;
    const bool leased = frame.leased != nullptr;
    while (!pipeline.submit(frame)) {
      if (session.stop) return;
      std::this_thread::sleep_for(milliseconds(1));  // every slot is held by the display
    }
    Result result = pipeline.wait().value();
    const FrameTimes times(frame, monotonic_ns());
    ++session.processed;
    // A frame that is not leased was copied, or made, by its source.
    session.copies += result.copies + (leased ? 0 : 1);
    if (options.recording) options.recording->measured(result.touch, times.measured_ns);
    if (options.presses) options.presses->add((*captured)->frame, result.touch);
    if (options.on_result) options.on_result(result.touch);
    if (auto displaced = session.to_display.put({std::move(*captured), std::move(result), times})) {
      latency.add(displaced->times);
      session.frames.put(std::move(displaced->captured));
    }
  }
}

/// Capture and engine at work; ended and joined at the latest with the object.
class Threads {
 public:
  Threads(LiveSession& session, Pipeline& pipeline, const std::function<std::unique_ptr<Source>()>& open,
          const LiveOptions& options, LatencyLog& latency)
      : session_(session),
        engine_([this, &pipeline, &options, &latency] {
          guarded([&] { engine_loop(session_, pipeline, options, latency); });
          session_.to_display.close();
        }),
        capture_([this, &open, &options] {
          guarded([&] { LiveCapture(session_, open, options).run(); });
          session_.to_engine.close();
        }) {}
  ~Threads() { join(); }
  Threads(const Threads&) = delete;
  Threads& operator=(const Threads&) = delete;

  void join() {
    session_.stop = true;
    if (capture_.joinable()) capture_.join();
    if (engine_.joinable()) engine_.join();
  }

 private:
  template <typename Work>
  void guarded(Work work) {
    try {
      work();
    } catch (...) {
      session_.fail(std::current_exception());
      session_.stop = true;
    }
  }

  LiveSession& session_;
  std::thread engine_, capture_;
};

/// Handling of results when there is no display.
class NoWindow : public LiveViewer {
 public:
  NoWindow(LiveSession& session, const LiveOptions& options, LatencyLog& latency)
      : session_(session), options_(options), latency_(latency) {}

  LiveReport run() override {
    LiveReport report;
    int64_t start_ns = 0, end_ns = 0;
    while (!session_.stop && !session_.to_display.finished()) {
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

}  // namespace

LiveReport run_session(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                       const Sensor& sensor, const Frame& background, const PipelineOptions& pipeline_options,
                       const LiveOptions& options, const MakeViewer& make_viewer) {
  LiveSession session;
  session.transport.speed = options.speed;
  session.use(open());
  Pipeline pipeline(context, sensor, session.source()->format(), pipeline_options);
  pipeline.set_background(background);
  LatencyLog latency(options.latency_file, options.on_times);
  const std::unique_ptr<LiveViewer> viewer = make_viewer(session, latency);

  Threads threads(session, pipeline, open, options, latency);
  LiveReport report = viewer->run();
  threads.join();
  session.rethrow();
  latency.close();
  if (options.presses) {
    report.presses = options.presses->finish();
    viewer->finish_presses();
  }
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
