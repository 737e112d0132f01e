// Kinds of sensors that people own: what is stated of the kind, and holds for each unit only roughly.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "palpate/frame.h"
#include "palpate/sensor.h"

namespace palpate {

struct NominalSensor {
  struct Mode {
    std::array<uint32_t, 2> size_px{};  ///< width, height
    double rate_Hz = 0;
  };
  struct Markers {
    double spacing_mm = 0, size_mm = 0;
  };

  std::string name;
  uint32_t channels = 3;
  std::vector<Mode> modes;
  std::array<double, 2> field_mm{};  ///< seen along the width and the height of every mode
  double relative_sd = 0;            ///< of the field
  std::optional<LayerCalibration> gel;
  std::optional<Markers> markers;
  Signal signal = Signal::Either;
  std::vector<std::string> not_known;  ///< of a single unit
  std::string source;                  ///< of the scale
};

/// A kind that comes with the program, by its name ("gelsight_mini"), or a file of one's own. Throws
/// Error(Failure::Usage) where there is none, with the names; Error(Failure::Sensor) where it is malformed.
NominalSensor load_nominal(const std::string& name_or_file);
std::vector<std::string> nominal_names();

/// Scale, gel, markers and signal of the kind for the camera's frames, upright ones too. Pixels that are not
/// square are made so. Colours to slopes, hence depth, stay unknown. Throws Error(Failure::Input) where no
/// mode of the kind has the frames' proportions or channels.
void apply_nominal(const NominalSensor& kind, const FrameFormat& camera, Sensor& sensor);

}  // namespace palpate
