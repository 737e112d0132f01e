// Live run of one input in a window, from its opening to its report: the common part of `live`, `replay` and
// the list of sources.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/recorder.h"
#include "capture/run/run_settings.h"
#include "capture/session/session.h"
#include "capture/source.h"
#include "viz/commands/command.h"
#include "viz/commands/option_groups/block_options.h"
#include "viz/commands/option_groups/serve_options.h"
#include "viz/display/run_live.h"
#include "viz/panels/settings.h"

namespace palpate {

/// The window's settings for one run of the program: read at its start, written at its end; trouble with
/// the file is a line in the log.
class Remembered {
 public:
  Remembered();
  ~Remembered();
  Remembered(const Remembered&) = delete;
  Remembered& operator=(const Remembered&) = delete;

  viz::Settings settings;
  std::string warning;  ///< of a damaged file
  /// Writes them now.
  void save() const;

 private:
  std::filesystem::path file_;
};

/// A live run: its settings, and where what it makes goes.
struct LiveRunRequest : RunSettings {
  std::filesystem::path out;  ///< for measurements.csv and all else; empty: none of it
  /// For sessions, snapshots and events where `out` is empty; may be empty. Snapshots and events have a
  /// folder there for each input, and those of a session lie in it.
  std::filesystem::path recordings;
  std::filesystem::path notes;  ///< for snapshots and events alone; empty: as above
  std::function<void(const std::string& json)>
      on_row;           ///< receives each measured frame as json_line writes it
  bool record = false;  ///< from the start; needs `out`
  /// A recording is shown with the keys of a player, its events are read, and what is marked is added to
  /// them.
  bool replay = false;
  BlockChoice block;  ///< that is pressed
  ServeChoice serve;
  bool window = true;  ///< false: for those who are served alone
  viz::WindowRun shown;
};

/// An input that is open: everything slow that needs no device.
struct OpenInput {
  MeasuredInput measured;
  std::unique_ptr<Source> source;
  Frame background;
  double start_s = 0;                     ///< of a session that is replayed: time of its first frame
  std::unique_ptr<PressMonitor> presses;  ///< null: no block of tissue is known
};

/// May take seconds with a camera; any thread. `cancelled` ends the waiting for frames. Throws Error.
OpenInput open_input(const LiveRunRequest& request, const std::function<bool()>& cancelled);

/// Events of a recording: those marked while it was recorded, and those marked in a window since.
std::vector<viz::Event> known_events(const LiveRunRequest& request);

struct LiveRunReport {
  MeasuredInput measured;
  FrameFormat format;
  LiveReport live;
  std::vector<Recording::Written> sessions;
  Facts served = {};
};

/// Main thread. Throws Error.
LiveRunReport run_live_input(gpu::Context& context, LiveRunRequest request, OpenInput opened);

/// What is said of a run at its end, with the exit code; the error of a session is a line in the log too.
/// `more`: facts for programs, behind those of input and device. `ends_by_ctrl_c`: that is how it is meant to
/// end.
Report report_of(const LiveRunReport& run, const gpu::Context& context, bool ends_by_ctrl_c = false,
                 const json::Value& more = json::Value::object());

/// Where sessions, snapshots and events go that no --out has a place for; made when the first is written.
/// Empty: nowhere.
std::filesystem::path recordings_folder(const viz::Settings& settings);

}  // namespace palpate
