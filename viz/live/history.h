// The last minute of measurements, and the events in it, for the strip charts.
#pragma once

#include <cstdint>
#include <deque>
#include <string>

#include "palpate/touch.h"

namespace palpate::viz {

/// One frame's worth, as measured (no zero applied).
struct Sample {
  double time_s = 0;
  bool contact = false;
  bool several = false;  ///< more than one contact: the force is the sum of theirs
  bool gap = false;      ///< does not continue the sample before
  Estimate force_N, shear_x_N, shear_y_N;
  double gray_sum = 0;  ///< gray levels
  bool has_depth = false;
  double depth_mm = 0;
  Slip slip = Slip::NotCalibrated;
};

/// A moment that somebody, or something, marked.
struct EventMark {
  double time_s = 0;
  std::string label;
};

class History {
 public:
  static constexpr double kLongest_s = 60;

  /// Once a result, in order of time; what jumps back in time (a replay, a loop) starts anew.
  void add(const Touch& touch);
  /// Events stay, whatever jumps; those out of sight are not drawn.
  void mark(EventMark event) { events_.push_back(std::move(event)); }

  const std::deque<Sample>& samples() const { return samples_; }
  const std::deque<EventMark>& events() const { return events_; }

 private:
  std::deque<Sample> samples_;
  std::deque<EventMark> events_;
};

}  // namespace palpate::viz
