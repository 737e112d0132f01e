// Statistics of a live session, as the window shows them.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>

#include "capture/live/latency.h"
#include "capture/session/session.h"
#include "capture/source.h"
#include "engine/palpation/hand/growing_scan.h"
#include "engine/palpation/press_monitor.h"

namespace palpate::viz {

/// Where a replay is.
struct PlayerStats {
  std::string name;       ///< file of the frame that is shown; empty where frames have none of their own
  bool timed = true;      ///< its frames have times
  uint64_t frames = 0;    ///< of the recording
  uint64_t position = 0;  ///< frame that is shown, from 0
  double speed = 1;
  bool at_end = false;
};

/// When one picture was there, ms after its frame's exposure or delivery, and what its drawing took.
struct PictureTimes {
  static constexpr int kKept = 240;  ///< of the last pictures
  double to_measured_ms = 0, to_shown_ms = 0, draw_ms = 0;
};

/// Statistics of a live session; its notes at the window's foot, its figures behind a key.
struct LiveStats {
  double captured_per_s = 0;
  double processed_per_s = 0;
  double shown_per_s = 0;
  Percentiles to_measured;  ///< from the frame's exposure, where it is known, else its delivery
  Percentiles to_shown;     ///< from there to the picture handed to the display
  std::deque<PictureTimes> recent;
  uint64_t captured = 0;
  uint64_t processed = 0;
  uint64_t shown = 0;
  uint64_t dropped_before_engine = 0;   ///< newer frames came while the engine was busy
  uint64_t dropped_before_display = 0;  ///< measured, but newer results came before they were shown
  double draw_ms = 0;                   ///< host time from submission to fence of a typical picture
  CaptureCounts camera;                 ///< what never got here
  std::string state;                    ///< why no frames come; empty while they do
  bool recording = false;
  SessionStatus session;  ///< of the session in hand, or of the last one
  std::optional<PlayerStats> player;
  std::string notes;                 ///< folder of snapshots and events at present; empty: there is none
  std::optional<PressStatus> press;  ///< where a block of tissue is known
  std::optional<ScanStatus> scan;    ///< where presses are made by hand
  std::string note;                  ///< "end of recording", "paused", "wrote ..."
  bool from_list = false;            ///< the person chose this source in the window and can go back
};

}  // namespace palpate::viz
