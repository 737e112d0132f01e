// One of two fingers with its input open, ready to be measured.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>

#include "capture/files/measurements.h"
#include "capture/pair/pair_files.h"
#include "capture/pair/pair_run.h"
#include "capture/run/input.h"
#include "capture/run/run_settings.h"
#include "capture/run/run_watch.h"

namespace palpate {

struct OpenFinger {
  MeasuredInput found;
  std::shared_ptr<Source> source;
  Frame background;
  PipelineOptions pipeline;
  LiveOptions live;

  /// `again`: a recorded finger with the settings that it was recorded with. A recording is read as fast as
  /// it can be measured, unless it has a rate. `watch` outlives it. Throws Error.
  OpenFinger(RunSettings settings, bool again, const RunWatch& watch);
  double rate_Hz() const { return live.rate_Hz > 0 ? live.rate_Hz : source->rate_Hz(); }
  /// As run_pair takes it; once, and this outlives the run.
  PairFinger pair() const;
};

/// measurements.csv of both fingers, each in the folder of its side.
class FingerTables {
 public:
  /// Makes the folders; both fingers' results go there from now on. Throws Error(Failure::Output).
  FingerTables(const std::filesystem::path& folder, std::array<OpenFinger, 2>& fingers);
  FingerTables(const FingerTables&) = delete;
  FingerTables& operator=(const FingerTables&) = delete;

  /// Hands all rows to the disk. Throws Error(Failure::Output).
  void close();

 private:
  std::array<std::optional<Measurements>, 2> rows_;
};

/// Inputs of both and the period of the slower one, as pair.json has them at the start.
PairInfo pair_info(const std::array<OpenFinger, 2>& fingers);

}  // namespace palpate
