// Options of a live session, and its outcome.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "capture/live/latency.h"
#include "capture/source.h"
#include "engine/palpation/press_monitor.h"
#include "palpate/device.h"
#include "palpate/frame.h"
#include "palpate/pipeline.h"

namespace palpate::gpu {
class Context;
}

namespace palpate {

class Recording;

/// Called on the caller's thread first, and on capture's at each start of a loop.
using OpenSource = std::function<std::shared_ptr<Source>()>;

/// Rate at which images without times are shown.
inline constexpr double kFolderRate_Hz = 10;

/// Settings of the loop that a person makes.
struct LoopSettings {
  static constexpr double kSlowest = 1.0 / 64, kFastest = 64;
  std::string input;          ///< as open_source takes it
  uint64_t max_frames = 0;    ///< ends after so many captured frames; 0: no limit
  double max_seconds = 0;     ///< ends after so long; 0: no limit
  double rate_Hz = 0;         ///< pace of a recording; 0: its own times (10 Hz where it has none)
  double speed = 1;           ///< of a replay, kSlowest to kFastest
  bool loop = false;          ///< starts a recording again at its end
  bool close_at_end = false;  ///< false: a player waits at the end, and the last picture stays
  /// How long a camera that is gone or silent is waited for; then the session ends with
  /// Error(Failure::Device).
  double patience_s = std::numeric_limits<double>::infinity();
};

struct LiveOptions : LoopSettings {
  uint64_t end = std::numeric_limits<uint64_t>::max();  ///< ends before this frame number
  double times_at_Hz = 0;  ///< results get their times from their numbers at this rate; 0: as the source says
  bool unpaced = false;    ///< a recording as fast as it can be read
  /// A recording waits for the engine, so that every frame is measured; cameras do not wait.
  bool measure_all = false;
  /// With measure_all: the viewer gets every result, and the engine waits for it.
  bool show_all = false;
  bool replay = false;         ///< a recording with the keys of a player: step, jump, speed
  bool outlive_device = true;  ///< false: a lost device ends the session with DeviceLost
  /// Opens a lost device anew, once nothing of the session is left on it, and returns the one to go on with;
  /// unset: Context::reopen.
  std::function<gpu::Context&(gpu::Context&)> reopen_device;
  /// Frames that all sessions on the device have measured, where it is shared; unset: this one's.
  std::function<uint64_t()> measured_on_device;
  std::filesystem::path latency_file;           ///< CSV with the times of every measured frame; empty: none
  Recording* recording = nullptr;               ///< what is written meanwhile; null: nothing can be
  PressMonitor* presses = nullptr;              ///< receives every measured frame; null: no block is pressed
  std::function<bool()> interrupted;            ///< polled; true ends the session cleanly (Ctrl-C)
  std::function<void(const Touch&)> on_result;  ///< every measured frame, in order, on the engine's thread
  /// The same with the frame, whose memory is the session's, and the maps; a call that waits lets newer
  /// frames pass.
  std::function<void(const Frame&, const Result&)> on_frame;
  std::function<void(const FrameTimes&)> on_times;  ///< every measured frame once its fate is known, one call
                                                    ///< at a time
  /// A device that was lost and is to be opened anew, on the caller's thread.
  std::function<void(const DeviceLost&)> on_device_lost;
  /// Each result that the viewer takes, before it is shown, on the caller's thread. The frame's memory is the
  /// session's.
  std::function<void(const Frame&, const Result&)> on_newest;
  // Without a window, on the caller's thread:
  std::function<void(uint64_t captured)> on_progress;  ///< now and then
  /// In place of a display: the newest result, or with show_all each, in order. The frame's memory is the
  /// session's.
  std::function<void(const Frame&, const Result&)> draw;
};

/// Outcome of a session.
struct LiveReport {
  uint64_t captured = 0;
  uint64_t processed = 0;
  uint64_t shown = 0;
  uint64_t dropped_before_engine = 0;  ///< newer ones came first, or the recorder had no room for them
  uint64_t dropped_before_display = 0;
  CaptureCounts camera;
  /// By the processor, from the source's memory (a camera driver's buffer, or what a decoder filled: that
  /// counts as one) to the engine's; the recorder's own is not counted.
  double copies_per_frame = 0;
  double seconds = 0;  ///< from the first frame delivered to the end
  double shown_per_s = 0;
  Percentiles to_measured;             ///< from exposure (or delivery) to the measurement
  Percentiles to_shown;                ///< from there to the finished picture, handed to the display
  bool latency_from_exposure = false;  ///< false: the source only knows when it delivered a frame
  double draw_median_ms = 0;
  uint32_t mesh_columns = 0;         ///< of the last picture
  std::vector<PressAnswer> presses;  ///< result of each press of a block
  std::string flaws;                 ///< of the pad since its untouched image; empty: none were found
  std::string warning;               ///< Source::warning(); empty when all is well
  uint32_t device_losses = 0;        ///< the device was opened anew so often
  bool interrupted = false;
  bool sources_requested = false;  ///< the person asked for the list of sources
};

}  // namespace palpate
