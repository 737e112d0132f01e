#include "capture/run/run_recording.h"

#include <deque>
#include <optional>
#include <utility>
#include <vector>

#include "palpate/error.h"

namespace palpate {

uint64_t run_recording(Source& source, Pipeline& pipeline, uint64_t limit, const std::function<bool()>& stop,
                       const std::function<void(const Result&, const Frame&)>& on_result, uint64_t end) {
  std::deque<Frame> in_flight;  // frames whose results are not out yet, oldest first
  std::vector<Frame> spare;     // their memory, to use again
  uint64_t done = 0;
  const auto finish_oldest = [&](std::optional<Result> result) {
    if (!result) return false;
    on_result(*result, in_flight.front());
    in_flight.front().give_back();  // not when its memory is used again
    spare.push_back(std::move(in_flight.front()));
    in_flight.pop_front();
    ++done;
    return true;
  };
  const auto finish_all = [&] {
    while (finish_oldest(pipeline.wait())) {
    }
  };
  try {
    for (uint64_t taken = 0; (limit == 0 || taken < limit) && !(stop && stop()); ++taken) {
      Frame frame;
      if (!spare.empty()) {
        frame = std::move(spare.back());
        spare.pop_back();
      }
      if (!source.next(frame) || frame.sequence >= end) break;
      while (!pipeline.submit(frame)) finish_oldest(pipeline.wait());
      in_flight.push_back(std::move(frame));
      while (finish_oldest(pipeline.poll())) {
      }
    }
  } catch (const Error& error) {
    // A recording damaged at frame n still has n good frames.
    if (error.failure() == Failure::Input) finish_all();
    throw;
  }
  finish_all();
  return done;
}

}  // namespace palpate
