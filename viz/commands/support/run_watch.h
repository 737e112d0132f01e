// Observer of a long run for a command.
#pragma once

#include "capture/run/run_watch.h"
#include "viz/commands/support/common.h"

namespace palpate {

/// Ctrl-C stops the run, a progress bar follows it.
RunWatch run_watch(const Common& common);

}  // namespace palpate
