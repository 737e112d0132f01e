// Where on a block's pressure map the lump shows: the bump above the smooth block, and the line at half its
// height. The bump is wider than the lump where that lies deep: an outline of what is felt, not of the lump.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/lump/observation/gaussian_profile.h"
#include "engine/lump/observation/observation.h"

namespace palpate::lump {

struct Outline {
  bool found = false;   ///< a bump, significant and inside what was seen; else `reason`
  std::string reason;   ///< why not, or why the outline is not closed
  bool closed = false;  ///< no part of the line leaves the seen part of the block
  std::vector<std::array<double, 2>> points_mm;  ///< from the block's middle, once around; only where closed

  Value area_mm2;                          ///< inside the outline
  Value width_mm;                          ///< of the circle of that area
  Value x_mm, y_mm;                        ///< of the bump's centre
  Value height_Pa;                         ///< above the smooth block
  std::array<double, 2> half_widths_mm{};  ///< Gaussian's s along its long and its short axis
  double angle_rad = 0;                    ///< of the long axis from +x towards +y
  double significance = 0;                 ///< height over its standard error, chi-square counted as noise
  double residual_Pa = 0;                  ///< rms of map minus block minus Gaussian
  PressureMap block_Pa;                    ///< the smooth block under the bump
};

/// The outline on the highest load. Block and bump are fitted at once: even powers of x and y up to the
/// fourth and a tilt, and an elliptical Gaussian (Gauss-Newton from several starts); the outer tenth of the
/// block, shaped by its rim, is left out. A bump counts where it is 6 standard errors and 3 % of the
/// block's own pressure high. The line at half height is drawn on map minus block. Intervals hold
/// nine of ten, by `repeats` maps with noise of observation.noise_Pa drawn from `seed` on top; those of the
/// centre cover where the window lies in the block too (observation.place_sd_mm). Throws
/// Error(Failure::Input) on fewer than 60 seen places.
Outline outline_lump(const Observation& observation, uint64_t seed = 1, uint32_t repeats = 40);

}  // namespace palpate::lump
