// Observation of a lump, read from files of pressure maps.
#pragma once

#include <filesystem>

#include "engine/lump/observation/observation.h"

namespace palpate {

/// A map of pressure, Pa: .npy (height x width) or a table of numbers (.csv: a line per row, empty or "nan"
/// where nothing was seen). Throws Error(Failure::Input).
fem::Map read_pressure_map(const std::filesystem::path& file, double pitch_mm);

/// "a lump of 8.1 mm (7.8 to 8.4) ...": the estimate in lines for people.
std::string estimate_text(const lump::Estimate& estimate);
std::string estimate_json(const lump::Estimate& estimate);

}  // namespace palpate
