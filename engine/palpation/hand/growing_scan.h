// Growing scan: presses by hand put together as they are made, in a thread of its own.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "engine/palpation/hand/hand_answer.h"
#include "engine/palpation/hand/press_reader.h"

namespace palpate {

/// A scan by hand as it is looked at.
struct SeenScan {
  PressReading reading;              ///< with the block that was pressed
  size_t presses = 0;                ///< put together so far
  std::optional<HandAnswer> answer;  ///< none before two presses fit each other
  std::string trouble;               ///< why there is none
};

/// State of a growing scan.
struct ScanStatus {
  bool on = false;                       ///< presses are taken
  bool working = false;                  ///< the newest are being read and put to the others
  bool full = false;                     ///< no room for more: what is there stays
  size_t presses = 0;                    ///< that are over and count
  std::string broken;                    ///< why the newest press does not count; empty: it does
  std::shared_ptr<const SeenScan> seen;  ///< another object where it has changed; null before the first one
};

/// Frames from one thread; the rest from any.
class GrowingScan {
 public:
  /// Most memory of the frames that presses are read from; of each press so many at most.
  static constexpr size_t kMost_bytes = size_t{512} << 20, kMostFrames = 64;

  /// As PressReader. No thread begins, and no frame is kept, before the first press while it is on.
  GrowingScan(const Sensor& sensor, const Frame& background);
  /// Ends presses being put together; within a second.
  ~GrowingScan();
  GrowingScan(const GrowingScan&) = delete;
  GrowingScan& operator=(const GrowingScan&) = delete;

  /// Whether presses are taken from the next one on.
  void switch_on(bool on);
  /// Begins anew: with the next press.
  void restart();

  void begin_press();
  /// A frame of the press with the force on the whole block; keeps a copy of its pixels, never waits.
  void add(const Frame& frame, double force_N);
  /// The press is over; `trouble`: why it does not count, empty: it does. A block unlike the one before it
  /// begins anew.
  void end_press(const std::string& trouble, const PressReading& reading);

  ScanStatus status() const;
  /// Until all presses that are over have been put together: for tests, and an end.
  void finish();

 private:
  struct Work;
  std::unique_ptr<Work> work_;
};

}  // namespace palpate
