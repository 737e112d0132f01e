// Tuning of a device by timing its kernels: a coordinate descent over few candidates.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "engine/gpu/tuning.h"
#include "perf/measure.h"

namespace palpate::perf {

struct TuneRequest {
  struct Size {
    uint32_t width = 0;   ///< px
    uint32_t height = 0;  ///< px
  };
  std::vector<Size> sizes{{640, 480}, {1392, 1042}};  ///< what counts is the mean over them
  int repetitions = 15;  ///< most pairs of present value and candidate that decide; at least five
  double seconds = 24;   ///< after which repetitions are cut short and no second sweep begins
  std::function<bool()> stopped = [] { return false; };
  std::function<void(const std::string&)> say = [](const auto&) {};  ///< progress, one line at a time
};

/// One constant. Times are relative to what was in use before: 0.9 is a tenth faster.
struct TunedField {
  std::string name;
  uint32_t usual = 0;   ///< without a measurement
  uint32_t best = 0;    ///< of the candidates
  uint32_t chosen = 0;  ///< best, if it is faster by more than the spread, or usual
  Quartiles best_time;  ///< of `best`
};

struct Tuned {
  Tuning tuning;
  std::vector<TunedField> fields;
  Quartiles frame_time;       ///< of a whole frame, chosen constants over usual ones
  bool frames_gained = true;  ///< false: candidates were taken back, since whole frames are no faster
  std::string clock;          ///< what was measured
  bool complete = false;      ///< false: stopped before the end
};

/// Kernels are timed one stage at a time, candidate and present value in turn, over all sizes. A candidate is
/// taken only if three quarters of its pairs are faster, by at least a hundredth. If in the end whole frames
/// do not gain, the usual constants stay. Throws Error(Failure::Device).
Tuned measure_tuning(gpu::Context& context, const TuneRequest& request);

}  // namespace palpate::perf
