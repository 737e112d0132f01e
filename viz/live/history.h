// Measurements of the last minute, or of a whole recording, and the events in them, for the strip charts.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "capture/files/event_log.h"
#include "palpate/touch.h"

namespace palpate::viz {

/// One frame's worth, as measured (no zero applied).
struct Sample {
  double time = 0;        ///< s, or the frame's number: see Timeline
  uint64_t position = 0;  ///< of the frame in its source
  bool contact = false;
  bool several = false;  ///< more than one contact: the force is the sum of theirs
  bool gap = false;      ///< does not continue the sample before
  Estimate force_N, shear_x_N, shear_y_N;
  std::optional<Estimate> layer_N;  ///< normal force by the elastic layer, where it is solved for
  double gray_sum = 0;              ///< gray levels
  bool has_depth = false;
  double depth_mm = 0;
  double depth_sd_mm = 0;  ///< 0: not known
  Slip slip = Slip::NotCalibrated;
};

/// A moment that somebody, or something, marked.
struct EventMark {
  double time = 0;  ///< as Sample::time
  std::string label;
};

/// A part of the axis of time.
struct TimeSpan {
  double end = 0, length = 1;  ///< s, or frames: see Timeline
};

/// The axis of time of a session.
struct Timeline {
  bool timed = true;    ///< false: pictures without times, and frames are counted instead
  uint64_t frames = 0;  ///< of a recording in which the person can jump; 0: none
  double rate_Hz = 0;   ///< of that recording
  double start_s = 0;   ///< time of its first frame, where timed
  /// Times of all frames of such a recording since the first, s, rising; empty: they come evenly.
  std::vector<double> uneven_s = {};
  bool separate = false;  ///< pictures of separate presses: nothing follows, and nothing is drawn over time

  bool whole() const { return frames > 0; }
  /// Time of the first frame, on the axis.
  double start() const { return timed ? start_s : 0; }
  /// From the first to the last frame: s or frames.
  double length() const;
  /// The frame nearest to a time on the axis.
  uint64_t frame_at(double time) const;
};

class History {
 public:
  static constexpr double kLongest_s = 60;

  explicit History(const Timeline& timeline = {}) : timeline_(timeline) {}

  /// Once a result. A recording in which the person can jump is kept whole, and a frame that is not there yet
  /// is a gap; else results come in order of time, what jumps back (a loop) starts anew, and a longer silence
  /// is a gap. `position`: of the frame in its source; without it the frame's number.
  void add(const Touch& touch, std::optional<uint64_t> position = {});
  /// Events stay, whatever jumps; those out of sight are not drawn.
  void mark(const Event& event);

  const Timeline& timeline() const { return timeline_; }
  const std::deque<Sample>& samples() const { return samples_; }
  const std::deque<EventMark>& events() const { return events_; }
  /// Time of the last result, on the axis.
  double now() const { return now_; }
  /// The event next to `time` on the axis, after it or before it; none: there is none on that side.
  std::optional<double> next_event(double time, bool after) const;

 private:
  Timeline timeline_;
  double now_ = 0;
  std::deque<Sample> samples_;
  std::deque<EventMark> events_;
};

}  // namespace palpate::viz
