// Report of a processed recording: its text, and summary.json.
#pragma once

#include "capture/run/processing.h"
#include "engine/base/facts.h"

namespace palpate {

/// Summary of a recording and, for inputs with known truth, a table of errors: a line for each quantity with
/// frames, mean error, RMS error, largest error and full scale.
Facts facts_of(const ProcessSummary& summary, const ProcessRequest& request, const Sensor& sensor,
               const gpu::Context& context);

}  // namespace palpate
