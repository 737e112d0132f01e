// A session: a folder that holds frames as they were measured, lossless, and everything needed to measure
// them again. frames.mkv holds the pixels (FFV1), frames.csv one row a frame, session.json the sensor and the
// settings, background.png or .tif the untouched image. README.md describes what survives a crash.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/source.h"
#include "palpate/pipeline.h"
#include "palpate/touch.h"

namespace palpate {

/// Data of a session other than its frames.
struct SessionInfo {
  std::string input;                ///< what was recorded, as open_source takes it
  std::optional<Sensor> sensor;     ///< that the frames were rectified and measured with; none: uncalibrated,
                                    ///< frames as the camera gave them
  FrameFormat format;               ///< of every frame
  double rate_Hz = 0;               ///< nominal; 0: none
  std::optional<Frame> background;  ///< the untouched image, of `format`; read back by own_background()
  Outputs outputs = {};             ///< that were measured, as in PipelineOptions; empty: none
  SurfaceSolver solver = SurfaceSolver::Live;
  SolveBy solve_by = SolveBy::Auto;
  bool fixed_light = false;
  bool separate = false;  ///< frames were pictures of separate presses, as in PipelineOptions
  std::string program_version;
  std::string device;                                        ///< that measured
  std::vector<std::pair<std::string, std::string>> details;  ///< of the camera: name and value, for people
};

struct SessionOptions {
  size_t queue_bytes = size_t{256} << 20;  ///< of frames that wait for the encoder; at least two fit
  /// A frame that would wait longer for the file, by the times of those before it, is dropped, so that a
  /// crash costs no more than a second also where the machine is too slow. More rides out longer stalls of
  /// processor and disk, at the price of what a crash may cost.
  double most_behind_s = 0.5;
  bool no_drop = false;  ///< record() waits for room instead of dropping
};

/// Progress of a recording.
struct SessionStatus {
  uint64_t recorded = 0;  ///< frames accepted by record()
  /// Numbers of the first and the last of them.
  uint64_t first_frame = 0, last_frame = 0;
  uint64_t written = 0;        ///< of those, handed to the file
  uint64_t dropped = 0;        ///< frames refused by record(): no room, or the recording has failed
  uint64_t measured = 0;       ///< recorded frames with measurements
  uint64_t unmatched = 0;      ///< measurements of frames that were not recorded; they have no row
  uint64_t queued = 0;         ///< frames that wait for the encoder
  uint64_t queue_bytes = 0;    ///< that these take
  double behind_s = 0;         ///< how long the oldest of them waits: what a crash now would cost
  uint64_t written_bytes = 0;  ///< of frames.mkv
  std::string error;           ///< why the recording has stopped, one line; empty while it goes on
};

/// Writes a session from threads of its own. record() comes from one thread, measured() from one, status()
/// from any.
class SessionWriter {
 public:
  /// Makes the folder and everything but the frames; the head of frames.mkv is on the disk when this returns.
  /// Throws Error(Failure::Output) where the folder holds a session already or cannot be written.
  SessionWriter(const std::filesystem::path& folder, const SessionInfo& info, SessionOptions options = {});
  ~SessionWriter();  ///< closes

  /// With no_drop a waiting record() asks this every 50 ms; true makes it give up. Before the first record().
  void watch(std::function<bool()> cancelled);
  /// Copies the frame and returns at once (with no_drop: when there is room). False: dropped, and counted.
  /// Sequence numbers must rise. Never throws; what fails is in status().
  bool record(const Frame& frame);
  /// The measurements of a frame after its record(), sequence numbers rising. `ready_ns`: when they were
  /// there, host's CLOCK_MONOTONIC; 0: not known.
  void measured(const Touch& touch, int64_t ready_ns = 0);
  SessionStatus status() const;
  /// Writes what is queued and ends the session; the same status again where it is closed already. Does not
  /// throw: status().error says what went wrong.
  SessionStatus close();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// True for a folder that is a session, and for its frames.mkv and session.json.
bool is_session(const std::filesystem::path& path);

/// The folder of a session that is named by itself or by its frames.mkv or session.json.
std::filesystem::path session_folder(const std::filesystem::path& session);

/// A recorded session as a source. Frames come back bit for bit with number, times and gaps; damaged ones are
/// left out and counted in counts().damaged. One thread, counts() any.
class Session : public Source {
 public:
  /// Opens the session as it was recorded. Throws Error(Failure::Input) where it is none, of a newer version,
  /// or holds no frame.
  explicit Session(const std::filesystem::path& folder);
  /// The same, for this sensor instead of the recorded one. Frames of a calibrated session are rectified
  /// already: crop and quad of `sensor` are not applied again, and must be absent or as recorded. Frames of
  /// an uncalibrated session are as the camera gave them: crop, quad and channels of `sensor` apply.
  Session(const std::filesystem::path& folder, const Sensor& sensor);
  ~Session() override;

  const SessionInfo& info() const;  ///< as recorded, without the background
  bool complete() const;            ///< it was closed, and all of it is there
  /// The recorded measurements of frame `sequence`, as Measurements::cells wrote them; none where it was not
  /// measured.
  std::optional<std::string> recorded(uint64_t sequence) const;
  /// The names of their cells, as Measurements::cell_names was then.
  std::string recorded_names() const;
  /// Numbers of all frames with recorded measurements, rising.
  std::vector<uint64_t> measured_sequences() const;

  FrameFormat format() const override;
  double rate_Hz() const override;
  std::vector<double> uneven_times_s() const override;
  bool pictures() const override;  ///< as it was recorded
  std::optional<uint64_t> frame_count() const override;
  bool next(Frame& frame) override;
  /// Missing parts of a session that was cut short; also before `next` has returned false.
  std::string warning() const override;
  std::optional<Frame> own_background() const override;
  CaptureCounts counts() const override;
  std::vector<std::pair<std::string, std::string>> details() const override;
  bool seek(uint64_t index) override;
  std::optional<uint64_t> place() const override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate
