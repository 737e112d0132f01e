// One of two fingers with its input open, ready to be measured.
#pragma once

#include <array>
#include <memory>
#include <optional>

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

/// What pair.json says of both at the start: inputs, and the period of the slower one.
PairInfo pair_info(const std::array<OpenFinger, 2>& fingers);

}  // namespace palpate
