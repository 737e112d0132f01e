// Settings of the next run in the list of sources, from their table.
#pragma once

#include "capture/run/run_settings.h"

namespace palpate::viz {

/// A value out of range becomes the default again.
void run_panel(RunSettings& run, float scale);

}  // namespace palpate::viz
