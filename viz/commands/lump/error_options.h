// Options for the errors of inputs that an estimate's intervals cover.
#pragma once

#include <optional>
#include <string>

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

/// Heading of skin and plate in the help.
inline constexpr const char* kPressGroup = "Skin and plate";

/// A skin as --skin-mm and --skin-ratio state it.
struct SkinOptions {
  std::string thickness_mm, ratio;
};
inline void add_skin(CommandLine& command, SkinOptions& skin) {
  command
      .add_option("--skin-mm", skin.thickness_mm,
                  "Thickness of a skin on the tissue, part of the thickness; 2+-0.2: known to 0.2 mm (sd)")
      ->option_text("MM")
      ->group(kPressGroup);
  command
      .add_option("--skin-ratio", skin.ratio, "Its modulus over that of the tissue below; 3+-0.6 likewise")
      ->option_text("NUM")
      ->group(kPressGroup);
}
/// None where neither is given. Throws Error(Failure::Usage) where one is missing or makes no sense, also for
/// a block of this thickness.
std::optional<lump::Skin> skin_of(const SkinOptions& skin, double block_thickness_mm);

/// A plate that does not slide freely, as --plate-friction and --plate-sticks state it.
struct PlateOptions {
  std::string friction;
  bool sticks = false;
};
inline void add_plate(CommandLine& command, PlateOptions& plate) {
  command
      .add_option("--plate-friction", plate.friction,
                  "Friction of a plate that does not slide freely (oil, talc): 0.1, or 0.1+-0.03 (sd)")
      ->option_text("NUM")
      ->group(kPressGroup);
  command.add_flag("--plate-sticks", plate.sticks, "It holds the tissue sideways")->group(kPressGroup);
}
/// None where neither is given. Throws Error(Failure::Usage) where both are, or the friction makes no sense.
std::optional<lump::Plate> plate_of(const PlateOptions& plate);

/// A value as it is stated: "4000", or "4000+-400" with its standard deviation, of which `share`, the error
/// of a 90 % interval relative to it, is set. Throws Error(Failure::Usage) for another text, a value outside
/// of `least` to `most` or an error above a half.
double stated_value(const std::string& option, const std::string& text, double least, double most,
                    double& share);

}  // namespace palpate
