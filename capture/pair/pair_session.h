// Two fingers measured together: a session of both that is recorded, or a recorded one that is measured
// again.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>

#include "capture/live/recorder.h"
#include "capture/pair/finger.h"
#include "capture/pair/pair_files.h"
#include "capture/pair/pair_recording.h"
#include "capture/pair/pair_run.h"
#include "capture/run/run_settings.h"
#include "capture/run/run_watch.h"

namespace palpate {

/// A run of two fingers before its start, for whoever looks on.
struct PairParts {
  std::array<OpenFinger, 2>& fingers;
  PairOptions& options;
  PairRecording* recording;  ///< null: nothing can be recorded
  const std::optional<KnownGrip>& grip;
};

/// Settings of both fingers; what RunSettings has once for each is in `fingers`, limits and the like are
/// equal.
struct PairRequest {
  std::array<RunSettings, 2> fingers;
  /// grip.json; empty: of two fingers of the scene grip its own, otherwise grip force and imbalance, load and
  /// turn are not known.
  std::filesystem::path grip;
  /// Folder to make; empty: nothing is recorded. Logs are the left finger's.
  std::filesystem::path out;
  /// `out` is of sessions that `attach` has begun and ended, each in a new folder there.
  bool switched = false;
  /// Recordings come at their own times, as from a camera, and none of their frames is dropped.
  bool paced = false;
  std::function<void(Side, const std::string& state)> on_state;  ///< as PairOptions has it
  std::function<void(const DeviceLost&)> on_device_lost;         ///< likewise
  std::function<void(const GripFrame&)> on_row;                  ///< each row of pairs.csv
  std::function<void(const PairParts&)> attach;                  ///< called before the run starts
};

/// Both fingers, ready to be measured together.
struct OpenPair {
  std::array<OpenFinger, 2> fingers;
  std::optional<KnownGrip> grip;
  PairInfo info;  ///< inputs and period
};
/// `watch` outlives it. Throws Error.
OpenPair open_pair(const PairRequest& request, const RunWatch& watch);
/// Of the folder of a recorded pair: with its own sensors, period and grip, and its settings where `settings`
/// leaves them open. Throws Error.
OpenPair open_recorded_pair(const std::filesystem::path& folder, const RunWatch& watch,
                            const RunSettings& settings = {});

struct PairOutcome {
  PairReport run;
  std::array<std::string, 2> inputs, sensors;
  std::vector<PairRecording::Written> recordings;
  std::vector<std::filesystem::path> folders;  ///< with pairs.csv
  uint64_t rows = 0;                           ///< of pairs.csv, of all recordings
  std::vector<std::string> logs;               ///< a line of each log beside both

  void add(std::vector<PairRecording::Written> written);
  std::vector<Recording::Written> sessions(Side side) const;
  /// Why a recording ended early; empty: none did.
  std::string error() const;
};

/// Measures both fingers and records them into `out`: left/ and right/, each a session, pair.json and
/// pairs.csv. A run that is killed leaves what each session leaves, and the rows up to then; so does one
/// whose disk is full, which ends. `context`: made once all that needs no device is there. Throws Error.
PairOutcome record_pair(const std::function<gpu::Context&()>& context, const PairRequest& request,
                        const RunWatch& watch);

/// Measures a recorded pair again with its own sensors and settings into `out`: pairs.csv, equal to the
/// recorded one where every frame was measured then, left/ and right/ with measurements.csv, and NAME_log.csv
/// of each log at the rows. `attach`: as PairRequest has it. Throws Error.
PairOutcome process_pair(const std::function<gpu::Context&()>& context, const std::filesystem::path& folder,
                         const std::filesystem::path& out,
                         const std::function<void(const GripFrame&)>& on_row, const RunWatch& watch,
                         const std::function<void(const PairParts&)>& attach = {});

}  // namespace palpate
