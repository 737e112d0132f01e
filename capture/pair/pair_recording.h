// The record switch of two fingers: folders of both sessions begin and end while frames go on.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <vector>

#include "capture/files/output_file.h"
#include "capture/live/recorder.h"
#include "capture/pair/finger.h"
#include "capture/pair/known_grip.h"
#include "capture/pair/pair_files.h"
#include "capture/pair/pair_meter.h"
#include "capture/run/run_watch.h"

namespace palpate {

/// pairs.csv and pair.json of one folder.
class PairRows {
 public:
  /// Throws Error(Failure::Output).
  PairRows(std::filesystem::path folder, PairInfo info, std::optional<KnownGrip> grip);

  /// `time_s`: since the run's first pair; the log of the opening counts from there.
  GripFrame add(const Matched<FingerTouch>& pair, double time_s);
  uint64_t rows() const { return rows_; }
  /// Says in pair.json that all rows are there. Once. Throws Error(Failure::Output).
  void close();

 private:
  std::filesystem::path folder_;
  PairInfo info_;
  std::optional<KnownGrip> grip_;
  LineFile file_;
  std::optional<PairMeter> meter_;  ///< from the first row on
  uint64_t rows_ = 0;
};

class PairRecording {
 public:
  struct Written {
    std::filesystem::path folder;
    std::array<Recording::Written, 2> sessions;  ///< left, right
    uint64_t rows = 0;                           ///< of pairs.csv
    std::string rows_error{};                    ///< why it or pair.json could not be written
    std::vector<std::string> logs{};             ///< a line of each log, as Recording has it

    /// Why it ended early; empty: it did not.
    const std::string& error() const {
      for (const Recording::Written& session : sessions)
        if (!session.status.error.empty()) return session.status.error;
      return rows_error;
    }
  };
  /// `folder`: names the next recording's, which is made. `no_drop`: frames wait for the disk. Fingers,
  /// context and `watch` outlive it.
  PairRecording(std::function<std::filesystem::path()> folder, const std::array<OpenFinger, 2>& fingers,
                const gpu::Context& context, std::optional<KnownGrip> grip, bool no_drop,
                const RunWatch& watch);

  /// Logs beside both, in a folder of the pair's own, and a line of one of this program; as Recording has
  /// them.
  void take(std::vector<std::unique_ptr<LogInput>> logs) { logs_.take(std::move(logs)); }
  void log(const std::string& name, std::string_view line) { logs_.add(name, line); }
  /// Of one finger, for its LiveOptions; started and stopped by this alone.
  Recording& of(Side side) { return *fingers_[index(side)]; }
  /// Caller's thread. Throws Error(Failure::Output).
  void start();
  /// Caller's thread. Rows of frames that are recorded and not measured yet still come.
  void stop();
  bool on() const;
  /// Each pair and each frame alone of the run, in order. The row that it becomes: frames that were not
  /// recorded have none, and a pair of which one was is that one alone. A disk that refuses ends the rows,
  /// and latest() says so.
  std::optional<GripFrame> add(const Matched<FingerTouch>& pair);

  /// Of the recording in hand, else of the last one; any thread.
  Written latest() const;
  /// Caller's thread. Ends the recording in hand and waits for the disk: all since the last call, in order.
  std::vector<Written> finish();

 private:
  void end_rows();
  void attempt(const std::function<void()>& write);

  std::function<std::filesystem::path()> folder_;
  PairInfo info_;
  std::optional<KnownGrip> grip_;
  std::filesystem::path next_;  ///< folder of the recording in hand
  std::array<std::optional<Recording>, 2> fingers_;
  LogSet logs_;
  std::optional<int64_t> zero_ns_;  ///< of the run
  mutable std::mutex mutex_;
  std::optional<PairRows> rows_;
  uint64_t last_rows_ = 0;        ///< of the recording before
  std::array<bool, 2> past_{};    ///< a frame has come that was taken after stop()
  std::vector<Written> written_;  ///< since finish(); the sessions are being written
};

}  // namespace palpate
