// Source of frames. A source delivers rectified frames of one format, in order, from one thread.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"
#include "truth.h"

namespace palpate {

/// Faults of a camera's stream, counted since it was opened.
struct CaptureCounts {
  uint64_t lost = 0;  ///< frames that the camera took and nobody got: gaps in its sequence numbers
  uint64_t damaged =
      0;              ///< frames that do not decode whole, or that the driver marked as faulty; not delivered
  uint64_t gaps = 0;  ///< times that the camera was away (unplugged, stalled) and came back
};

class Source {
 public:
  Source() = default;
  Source(const Source&) = delete;
  Source& operator=(const Source&) = delete;
  virtual ~Source() = default;

  /// Format of every frame after cropping and rectification.
  virtual FrameFormat format() const = 0;
  /// Nominal rate; 0 where a source has none (a folder of images).
  virtual double rate_Hz() const = 0;
  /// Whether frames are pictures that need not follow each other: without a rate, and not live.
  virtual bool pictures() const { return !live() && rate_Hz() <= 0; }
  /// Number of frames, where known in advance.
  virtual std::optional<uint64_t> frame_count() const = 0;
  /// Fills `frame` (reusing its memory) and returns true, or returns false after the last frame.
  /// Throws Error(Failure::Input) on a damaged file or a frame whose size differs from the first.
  virtual bool next(Frame& frame) = 0;
  /// The file of frame `sequence`, without its folder; empty where frames have none of their own.
  virtual std::string frame_name(uint64_t /*sequence*/) const { return {}; }
  /// Warning about this input, one line, once `next` has returned false: a recording that is cut short, a
  /// camera that does not keep its rate. Empty when all is well.
  virtual std::string warning() const { return {}; }
  /// Whether this recording has ended before the end that its file states; known once `next` has returned
  /// false.
  virtual bool cut_short() const { return false; }
  /// The untouched image that this source knows of itself (the synthetic sensor's), if any.
  virtual std::optional<Frame> own_background() const { return std::nullopt; }
  /// True for a camera: frames come when they come, and one that is not taken in time is lost.
  virtual bool live() const { return false; }
  /// Any thread.
  virtual CaptureCounts counts() const { return {}; }
  /// Why no frames come at present, in a few words ("camera unplugged, waiting"); empty while they do. Any
  /// thread.
  virtual std::string state() const { return {}; }
  /// Settings that a camera uses (format, rate, controls as read back, clock, copies per frame), for people
  /// and records: names and values in order. Any thread.
  virtual std::vector<std::pair<std::string, std::string>> details() const { return {}; }
  /// A `next` that waits asks this every 50 ms at least; true makes it return false. Before the first `next`.
  virtual void watch(const std::function<bool()>& /*cancelled*/) {}
  /// The next frame will be number `index` of the recording, counted from 0 and marked after_gap; false where
  /// this source cannot jump or has no such frame.
  virtual bool seek(uint64_t /*index*/) { return false; }
  /// Number in the recording of the last frame of `next`, as `seek` counts: more than were delivered where
  /// damaged ones are left out. Nothing: none is left out, or this is no recording.
  virtual std::optional<uint64_t> place() const { return std::nullopt; }
  /// Truth of frame `sequence`; only synthetic sources have one. Safe to call from any thread.
  virtual std::optional<Truth> truth(uint64_t /*sequence*/) const { return std::nullopt; }
  /// Times of all frames of a recording since its first, s, rising; empty where they come evenly at
  /// `rate_Hz`, or are not known in advance.
  virtual std::vector<double> uneven_times_s() const { return {}; }
};

/// Times since the first, s; empty where they do not rise, or are those of an even rate to a quarter of its
/// period.
std::vector<double> uneven_times(const std::vector<int64_t>& times_ns, double rate_Hz);

}  // namespace palpate
