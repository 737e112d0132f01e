// Observation of a lump, read from files of pressure maps.
#pragma once

#include <filesystem>

#include "engine/lump/observation/observation.h"

namespace palpate {

/// A map of pressure, Pa: .npy (height x width) or a table of numbers (.csv: a line per row, empty or "nan"
/// where nothing was seen). Throws Error(Failure::Input).
PressureMap read_pressure_map(const std::filesystem::path& file, double pitch_mm);

/// An observation as it is kept for another day: `observation.json` (loads, window, tissue, noise) and
/// `pressure_Pa.npy` (loads x height x width). Throws Error(Failure::Output).
void write_observation(const std::filesystem::path& folder, const lump::Observation& observation);
/// The same back, from the folder or its observation.json. Throws Error(Failure::Input).
lump::Observation read_observation(const std::filesystem::path& path);

}  // namespace palpate
