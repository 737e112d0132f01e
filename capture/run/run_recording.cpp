#include "capture/run/run_recording.h"

#include "capture/live/live.h"

namespace palpate {

uint64_t run_recording(Source& source, Pipeline& pipeline, uint64_t limit, const std::function<bool()>& stop,
                       const std::function<void(const Result&, const Frame&)>& on_result, uint64_t end) {
  uint64_t done = 0;
  LiveOptions options;
  options.unpaced = options.measure_all = options.show_all = true;
  options.max_frames = limit;
  options.end = end;
  options.interrupted = stop;
  options.draw = [&](const Frame& frame, const Result& result) {
    on_result(result, frame);
    ++done;
  };
  run_without_window(
      pipeline, [&] { return std::shared_ptr<Source>(&source, [](Source*) {}); }, options);
  return done;
}

}  // namespace palpate
