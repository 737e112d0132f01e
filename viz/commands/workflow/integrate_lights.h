// palpate integrate --lights: from images under several lights to a height map.
#pragma once

#include <filesystem>
#include <vector>

#include "viz/commands/command.h"

namespace palpate {

struct LightsRequest {
  std::vector<std::filesystem::path> images;
  std::filesystem::path lights;  ///< what palpate calibrate lights wrote
  std::filesystem::path truth;   ///< heights to judge by; empty: none
};

/// Writes height.npy (mm, mean 0) to Common::out. Throws Error where files do not fit each other.
Report integrate_lights(const Common& common, const LightsRequest& request);

}  // namespace palpate
