// GelSight Minis of which only the scale is known, calibrated on presses of a ball.
#pragma once

#include <filesystem>

#include "capture/calibrate/workflow/workflow.h"

namespace palpate {

constexpr double kMiniPitch_mm = 0.0634;

inline CalibrationReport calibrated_mini(const std::filesystem::path& presses,
                                         const std::filesystem::path& background, double ball_mm) {
  PhotometricRequest request;
  request.input = presses.string();
  request.background = background;
  request.ball.radius_mm = ball_mm;
  request.pitch_mm_per_px = kMiniPitch_mm;
  const RunWatch watch;
  return calibrate_photometric(request, {{}, watch});
}

}  // namespace palpate
