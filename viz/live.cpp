#include "viz/live.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <thread>
#include <vector>

#include "engine/gpu/context.h"
#include "viz/display.h"
#include "viz/live_session.h"

namespace palpate::viz {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

void capture_loop(LiveSession& session, std::unique_ptr<Source> source,
                  const std::function<std::unique_ptr<Source>()>& open, const LiveOptions& options) {
  const double rate_Hz = options.rate_Hz > 0     ? options.rate_Hz
                         : source->rate_Hz() > 0 ? source->rate_Hz()
                                                 : 10;
  const auto period = std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(1 / rate_Hz));
  Clock::time_point due = Clock::now();
  std::vector<CapturedPtr> spare;
  int64_t loop_offset_ns = 0, last_time_ns = 0;
  uint64_t frames_in_this_round = 0, sequence = 0;
  while (!session.stop) {
    if (session.paused) {
      std::this_thread::sleep_for(milliseconds(10));
      due = Clock::now();
      continue;
    }
    for (CapturedPtr& used : session.frames.take_all()) spare.push_back(std::move(used));
    CapturedPtr item = spare.empty() ? std::make_unique<Captured>() : std::move(spare.back());
    if (!spare.empty()) spare.pop_back();
    if (!source->next(item->frame)) {
      if (!options.loop || frames_in_this_round == 0) break;
      source = open();
      // Time goes on across the seam, one period after the last frame.
      loop_offset_ns = last_time_ns + std::chrono::nanoseconds(period).count();
      frames_in_this_round = 0;
      spare.push_back(std::move(item));
      continue;
    }
    ++frames_in_this_round;
    if (options.loop) {
      item->frame.time_ns += loop_offset_ns;
      item->frame.sequence = sequence;
    }
    ++sequence;
    last_time_ns = item->frame.time_ns;
    std::this_thread::sleep_until(due);
    const Clock::time_point now = Clock::now();
    due = std::max(due + period, now - period);  // a slow source is not chased
    item->at = now;
    if (auto displaced = session.to_engine.put(std::move(item))) spare.push_back(std::move(*displaced));
    if (++session.captured == options.max_frames) break;
  }
}

void engine_loop(LiveSession& session, Pipeline& pipeline, const LiveOptions& options) {
  const auto release_returned = [&] {
    for (const Result& r : session.results.take_all()) pipeline.release(r);
  };
  while (!session.stop && !session.to_engine.finished()) {
    release_returned();
    auto captured = session.to_engine.take(milliseconds(20));
    if (!captured) continue;
    while (!pipeline.submit((*captured)->frame)) {
      if (session.stop) return;
      std::this_thread::sleep_for(milliseconds(1));  // every slot is held by the display
      release_returned();
    }
    Result result = pipeline.wait().value();
    ++session.processed;
    if (options.on_result) options.on_result(result.touch);
    if (auto displaced = session.to_display.put({std::move(*captured), result})) {
      pipeline.release(displaced->result);
      session.frames.put(std::move(displaced->captured));
    }
  }
}

}  // namespace

LiveReport run_live(gpu::Context& context, const std::function<std::unique_ptr<Source>()>& open,
                    const Sensor& sensor, const Frame& background, PipelineOptions pipeline_options,
                    const LiveOptions& options) {
  std::unique_ptr<Source> source = open();
  LiveSession session;
  // Current picture, pictures in flight, mailbox, engine.
  pipeline_options.slots =
      std::max(pipeline_options.slots, context.is_software() ? 4u : Window::kPicturesInFlight + 3);
  Pipeline pipeline(context, sensor, source->format(), pipeline_options);
  pipeline.set_background(background);
  Display display(context, sensor, options, session);

  const auto guarded = [&session](auto work, auto finish) {
    try {
      work();
    } catch (...) {
      session.fail(std::current_exception());
      session.stop = true;
    }
    finish();
  };
  std::thread engine([&] {
    guarded([&] { engine_loop(session, pipeline, options); }, [&] { session.to_display.close(); });
  });
  std::thread capture([&] {
    guarded([&] { capture_loop(session, std::move(source), open, options); },
            [&] { session.to_engine.close(); });
  });
  struct Join {
    LiveSession& session;
    std::thread& capture;
    std::thread& engine;
    void now() {
      session.stop = true;
      if (capture.joinable()) capture.join();
      if (engine.joinable()) engine.join();
    }
    ~Join() { now(); }
  } join{session, capture, engine};
  LiveReport report = display.run();
  join.now();
  session.rethrow();
  return report;
}

}  // namespace palpate::viz
