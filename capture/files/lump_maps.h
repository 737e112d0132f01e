// Observation of a lump, read from files of pressure maps.
#pragma once

#include <filesystem>

#include "engine/lump/observation/observation.h"

namespace palpate {

/// A map of pressure, Pa: .npy (height x width) or a table of numbers (.csv: a line per row, empty or "nan"
/// where nothing was seen). Throws Error(Failure::Input).
PressureMap read_pressure_map(const std::filesystem::path& file, double pitch_mm);

}  // namespace palpate
