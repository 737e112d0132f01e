// Options for tissue that relaxes while the plate rests.
#pragma once

#include <optional>
#include <string>

#include "engine/lump/observation/observation.h"
#include "viz/commands/support/options.h"

namespace palpate {

/// Relaxing tissue as --relaxation, --move-s, --rest-s and --relaxation-error state it.
struct RelaxationOptions {
  std::string series;
  lump::Relaxation times;  ///< without terms
};
inline void add_relaxation(CommandLine& command, RelaxationOptions& relaxation) {
  constexpr const char* kGroup = "Relaxing tissue";
  command
      .add_option("--relaxation", relaxation.series,
                  "Shares of the modulus that are lost while the plate rests, and in what times, s: "
                  "0.2:3,0.1:30 (a Prony series); the modulus is then that right after a step")
      ->option_text("SHARE:S,...")
      ->group(kGroup);
  command
      .add_setting("--move-s", relaxation.times.move_s, Check::range(0.0, 1e6),
                   "Time in which the plate moves to each load, from the one before")
      ->group(kGroup);
  command
      .add_setting("--rest-s", relaxation.times.rest_s, Check::range(0.0, 1e6),
                   "Time for which it rests there before it is read")
      ->group(kGroup);
  command
      .add_setting("--relaxation-error", relaxation.times.share_error, Check::range(0.0, 0.5),
                   "Relative error of these shares, 90 % interval; widens the intervals")
      ->group(kGroup);
}
/// None where no series is given. Throws Error(Failure::Usage) for another text, shares that are not above 0
/// or are 1 and more in all, and times that are not above 0.
std::optional<lump::Relaxation> relaxation_of(const RelaxationOptions& relaxation);

}  // namespace palpate
