// Wrench of a recording, frame by frame: the force and moment by the elastic layer, compared with a gauge
// where there is one.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "capture/calibrate/force/gauged_recording.h"
#include "capture/run/input.h"
#include "capture/run/run_watch.h"
#include "palpate/touch.h"

namespace palpate {

struct WrenchFrame {
  uint64_t frame = 0;
  double time_s = 0;  ///< since the recording began; NaN: not known
  bool contact = false;
  TractionSummary wrench;
  double gauge_N = 0;  ///< NaN: no reading
};

/// Traction of one frame, kept.
struct TractionPicture {
  uint32_t width = 0;  ///< cells
  uint32_t height = 0;
  double cell_mm = 0;
  std::vector<float> pressure_kPa, shear_x_kPa, shear_y_kPa;  ///< shear is empty where no skin is followed
};

struct WrenchSeries {
  std::vector<WrenchFrame> frames;
  std::optional<size_t> peak;  ///< of frames: the largest normal force; none: nothing touches
  TractionPicture at_peak;
  std::vector<std::string> notes;  ///< of the gauge, one line each
};

/// Measures every frame. `gauge`: its table, "truth" of a synthetic recording, or empty. Throws
/// Error(Failure::Sensor) on a sensor without a layer or a surface, Error(Failure::Input) where recording and
/// gauge do not go together.
WrenchSeries measure_wrench(gpu::Context& context, const MeasuredInput& input, const GaugeRequest& gauge,
                            const RunWatch& watch);

/// The normal force against the gauge, of frames in which something touches and the gauge says more than 4 %
/// of its largest reading.
struct WrenchCheck {
  size_t readings = 0;
  size_t valid = 0;   ///< of them, whose force says that it is
  double full_N = 0;  ///< largest reading of the gauge
  double mean_error_N = 0, valid_mean_error_N = 0;
  double scale = 0;     ///< gauge = scale * force, by least squares: what the modulus would be corrected by
  double coverage = 0;  ///< fraction within the stated 95 % interval
};
/// None: without a gauge, or without a reading to compare.
std::optional<WrenchCheck> check_wrench(const WrenchSeries& series);

/// A component by its name within a wrench: "fx_N".
struct WrenchComponent {
  std::string_view name;
  std::string_view unit;
  Estimate estimate;
};
/// Forces along x, y and z, then moments about them.
std::vector<WrenchComponent> components(const TractionSummary& wrench);

/// One line a frame: frame, time_s, contact, six components with their standard errors and states,
/// pressure_max_kPa, shear_max_kPa, gauge_N.
std::string wrench_csv(const WrenchSeries& series);

}  // namespace palpate
