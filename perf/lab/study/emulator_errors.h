// What the emulator is off by: its bump of each known lump, held against the block as it was pressed.
#pragma once

#include <string>
#include <vector>

#include "engine/base/json.h"
#include "perf/lab/training/training.h"

namespace palpate::lump {

struct EmulatorError {
  Example truth;        ///< without its maps
  double fraction = 0;  ///< RMS over the patch around the lump (without one: over the block), of the peak
                        ///< pressure, at the highest load
  double of_bump = 0;   ///< the same over the RMS of the lump's own bump; 0 without a lump
  double fields = 0;    ///< the part that no sum of the model's fields can be, of the peak pressure
};

/// Of each block that the model knows the like of (its thickness, and loads): free of noise, on all of the
/// surface. The emulator speaks for its finest cells.
std::vector<EmulatorError> emulator_errors(const Network& network, const std::vector<Example>& examples);

/// Medians and nine in ten by kinds of lumps.
std::string emulator_errors_text(const std::vector<EmulatorError>& errors);
std::string emulator_errors_csv(const std::vector<EmulatorError>& errors);
json::Value emulator_errors_json(const std::vector<EmulatorError>& errors);

}  // namespace palpate::lump
