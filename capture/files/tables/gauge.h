// Table of a force gauge that ran with a recording: CSV with times or frames, and forces.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "engine/calibrate/gauge_zero.h"

namespace palpate {

/// A stretch of a gauge's table without readings, in its own time.
struct GaugeGap {
  double from_s = 0;
  double to_s = 0;
};

/// A gauge's readings, times in s on its own clock or frames of the recording, forces in N. Columns that the
/// file does not have are empty.
struct Gauge {
  std::string file;
  std::vector<double> time_s;      ///< rising; empty where the table counts frames
  std::vector<uint64_t> frames;    ///< rising
  std::vector<double> force_N;     ///< normal
  std::vector<double> fx_N;        ///< tangential, along the image's x (right)
  std::vector<double> fy_N;        ///< and y (down)
  std::vector<std::string> notes;  ///< units that were converted, a missing direction; one line each
  std::vector<GaugeGap> gaps;      ///< where readings are further apart than five usual intervals (and 20 ms)

  /// Mostly negative normal forces, as of a gauge to which a press is negative.
  bool reads_negative() const;
  /// Turns the sign of the normal force, and notes it.
  void turn();

  size_t size() const { return by_frame() ? frames.size() : time_s.size(); }
  bool by_frame() const { return time_s.empty(); }
  bool has_shear() const { return !fx_N.empty(); }
};

/// Which columns must be there.
enum class GaugeColumns { Normal, Tangential, Both };

/// Reads a table with one header line; cells are separated by comma, semicolon (decimal commas are then
/// understood) or tab, lines that begin with # are left out. Columns: `time` with a unit (time_s, time_ms,
/// time_us, time_ns, also "Time [s]", "time (ms)") or `frame`; `force` (or fz, load, weight) with a unit (N,
/// mN, kN, gf, kgf, lbf; g, kg and lb of a scale are weights); for tangential forces fx and fy, or shear with
/// a unit and `direction` in deg or rad, from +x towards +y. Others are not read. Throws
/// Error(Failure::Input) that names file, line and column on a missing or unknown unit, times that do not
/// rise, cells that are no finite number, an empty table, or fewer than 3 readings.
Gauge read_gauge(const std::filesystem::path& file, GaugeColumns wanted);

/// One of a gauge's columns at a time on its clock, straight between readings; none outside of them and
/// within a gap.
std::optional<double> gauge_at(const Gauge& gauge, const std::vector<double>& column, double time_s);
/// The same of a table that counts frames.
std::optional<double> gauge_at_frame(const Gauge& gauge, const std::vector<double>& column, uint64_t frame);

/// Takes off what a column reads while nothing touches, as the untouched frames have it (see
/// engine/calibrate/gauge_zero.h). `readings`: of each frame of a recording in order, NaN: none. Gives a line
/// that says what was taken off, or that no frame is untouched; empty: its zero is right. `what`: "the
/// normal force of FILE"; `pressed`: of which sign a touch is; `range_N`: at least that of the column, where
/// it is one of several. Throws Error(Failure::Input), with the values, where it has no steady zero.
std::string take_off_zero(std::vector<double>& readings, const std::vector<bool>& touched,
                          const std::string& what, Pressed pressed = Pressed::Above, double range_N = 0);

/// "2 gaps without readings, 0.3 s in all, the longest from 1.2 s to 1.4 s"; empty without gaps.
std::string describe_gaps(const Gauge& gauge);

}  // namespace palpate
