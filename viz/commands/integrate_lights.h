// palpate integrate --lights: images under several lights in, a height map out.
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
