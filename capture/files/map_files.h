// Files of a map that is larger than the pad: arrays, mesh, image, and a description.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/base/json.h"
#include "engine/map/object_map.h"

namespace palpate {

/// Writes map.npy, map_error.npy, coverage.npy, map.ply and map.tif of the largest piece into `folder`, which
/// exists; of the others map_2.npy and so on. Returns the names. Arrays are float32, rows from the smallest y
/// down, mm (coverage: key frames), NaN where nothing was seen. The TIFF holds the same floats; the mesh what
/// was seen, y up, with error and coverage. Throws Error(Failure::Output).
std::vector<std::string> write_map(const std::filesystem::path& folder, const MapSnapshot& map);

/// Sizes, key frames and errors of each piece; `first_index` 1 is the largest.
json::Value map_json(const MapSnapshot& map);

/// RMS of the stated errors over what was seen, mm; NaN where they are not known.
double stated_error_mm(const FusedMap& map);

}  // namespace palpate
