// Observations of presses of a sample, from a recording's frames or from a table.
#pragma once

#include <cmath>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "engine/elasticity/modulus/modulus.h"
#include "palpate/pipeline.h"
#include "palpate/sensor.h"

namespace palpate {
namespace gpu {
class Context;
}

/// Where a contact ends, by the picture.
struct ContactEdge {
  double radius_mm = 0;  ///< of the circle of the same area; NaN: not known
  double sd_mm = 0;
  double x_px = 0, y_px = 0;  ///< its middle
  double half_gray = 0;       ///< a flat contact's: half of its mean change
  double core_px = 0;         ///< and a radius that is surely inside
  bool in_core(double x, double y) const { return std::hypot(x - x_px, y - y_px) < core_px; }
};

/// By the change from the untouched image, filtered, height x width gray. A flat contact ends where half of
/// its mean light is left; a ball's where the square of the pressure, a straight line over the squared
/// distance, reaches zero. `sensor` is one that reads pressure (SurfaceReading::Elastic).
ContactEdge find_edge(const std::vector<float>& change, uint32_t width, uint32_t height, const Sensor& sensor,
                      bool flat);

/// Reads single frames. Not thread safe.
class SampleReader {
 public:
  /// Depths need a sensor with a reading of the surface. `background`: the untouched image. `series`: input
  /// of the frames where they are separate pictures (PipelineOptions); empty: they follow each other.
  SampleReader(gpu::Context& context, const Sensor& sensor, const Frame& background, const Sample& sample,
               const std::string& series = {});

  /// Nothing where nothing touches, or the contact reaches the border or saturates. A sensor that does not
  /// observed pressure gives a contact's radius by its area.
  std::optional<PressFrame> read(const Frame& frame);
  bool depth_by_pressure() const { return sensor_.reading == SurfaceReading::Elastic; }
  const std::string& why_not() const { return why_not_; }
  static constexpr const char* kUntouched = "nothing touches";

 private:
  Sensor sensor_;
  Sample sample_;
  Frame background_;
  Pipeline pipeline_;
  std::string why_not_;
};

/// Columns force_N, and any of radius_mm or area_mm2, depth_mm, mean_depth_mm, approach_mm, each also with
/// _sd before its unit (force_sd_N, radius_sd_mm), and in other units (radius_um). Empty cells are not
/// measured. `notes` gets a line for units that were converted, one for a stage that counts down (which is
/// turned) and one for columns that are not read. Throws
/// Error(Failure::Input) naming file, line and column.
std::vector<PressFrame> read_press_table(const std::filesystem::path& file, std::vector<std::string>& notes);
/// A stage that counts down while it presses: turns the sign of all approaches, and notes it.
void turn_stage(std::vector<PressFrame>& frames, std::vector<std::string>& notes);
std::string press_table(const std::vector<PressFrame>& frames);

/// Column approach_mm (or _um, _cm ...) of a table by frame: for each of these frames, straight between rows;
/// NaN outside. `notes` as above.
std::vector<double> read_approach_table(const std::filesystem::path& file,
                                        const std::vector<uint64_t>& frames, std::vector<std::string>& notes);

}  // namespace palpate
