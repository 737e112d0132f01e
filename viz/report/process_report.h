// Report of a processed recording, as text.
#pragma once

#include <string>

#include "capture/run/processing.h"

namespace palpate {

/// Summary of a recording and, for inputs with known truth, a table of errors: a line for each quantity with
/// frames, mean error, RMS error, largest error and full scale.
std::string describe(const ProcessSummary& summary);

}  // namespace palpate
