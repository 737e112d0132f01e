// Files of photometric stereo with one light per image: images, known heights, and the calibration of the
// stack of lights.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "engine/calibrate/light_stack.h"
#include "palpate/sensor.h"

namespace palpate {

/// Gray images of 8 or 16 bits and one size, one for each light in the order of the lights. Throws
/// Error(Failure::Input) with fewer than three.
LightImages read_light_images(const std::vector<std::filesystem::path>& files);

/// Heights in mm, rows x columns: a NumPy array, or a TrueMap file (.tmd, version 2, as GelSight's scanners
/// write it). Unknown values are NaN. Throws Error(Failure::Input) where its size is not that of the images.
std::vector<float> read_heights(const std::filesystem::path& file, const LightImages& images);

/// A calibrated stack as a file.
struct LightCalibration {
  LightStack stack;
  uint32_t width = 0, height = 0;  ///< of the images
  double pitch_mm_per_px = 0;
  double bands_mm = 0;   ///< RMS error of heights on bands that were held out
  double halves_mm = 0;  ///< on halves
  Origin origin;
};

/// Throws Error(Failure::Output).
void save_light_calibration(const LightCalibration& calibration, const std::filesystem::path& file);
/// Throws Error(Failure::Sensor) that names the key, wanted and found.
LightCalibration load_light_calibration(const std::filesystem::path& file);

}  // namespace palpate
