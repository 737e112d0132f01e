// Options for the errors of inputs that an estimate's intervals cover.
#pragma once

#include "engine/lump/error_sources.h"
#include "viz/commands/support/options.h"

namespace palpate {

/// --young-error, --thickness-error and --pitch-error.
inline void add_error_sources(CommandLine& command, lump::ErrorSources& sources) {
  command
      .add_option("--young-error", sources.young,
                  "Relative error of the modulus, 90 % interval; widens the intervals")
      ->capture_default_str()
      ->check(Check::range(0.0, 0.5));
  command.add_option("--thickness-error", sources.thickness, "The same of the thickness")
      ->capture_default_str()
      ->check(Check::range(0.0, 0.5));
  command.add_option("--pitch-error", sources.pitch, "The same of the pitch")
      ->capture_default_str()
      ->check(Check::range(0.0, 0.5));
}

}  // namespace palpate
