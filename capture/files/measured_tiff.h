// Measured TIFF: one number a pixel, in units, with the pixels' distance.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <variant>

namespace palpate {

struct MeasuredTiff {
  uint32_t width = 0, height = 0;  ///< px
  double pitch_mm = 0;             ///< > 0
  std::string about;  ///< what the numbers are, with their unit, and the name of what is pitch_mm apart
  /// Row by row: signed whole numbers of 16 bits, or floats. The encoder may overwrite them.
  std::variant<std::span<int16_t>, std::span<float>> values;
  bool predicted = true;  ///< compressed by differences along rows
};

/// Throws Error(Failure::Output).
void write_measured_tiff(const std::filesystem::path& file, const MeasuredTiff& picture);

}  // namespace palpate
