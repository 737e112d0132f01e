// A recorded press as a press of a scan: frames of a force-calibrated sensor at chosen forces of the gauge
// behind the plate, as pressure maps.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "capture/run/palpation/press_timeline.h"
#include "engine/lump/observation/scan_stitch.h"

namespace palpate {

/// The table of places: a header line with recording, x_mm, y_mm and, where --gauge does not say it for all,
/// gauge. `recordings` (may be empty: all rows) names those wanted; a row belongs to a recording of the same
/// path or the same last name. Paths in the table are taken from its folder where they are not there as they
/// stand. Throws Error(Failure::Input) naming line and column.
std::vector<RecordedPress> read_places(const std::filesystem::path& table,
                                       const std::vector<std::string>& recordings, const std::string& gauge);

struct RecordedOptions {
  std::filesystem::path sensor;  ///< empty: the recording's own
  uint64_t seed = 1;             ///< of synthetic recordings that name none
  uint32_t loads = 4;            ///< even fractions of the highest force that every press reached
  double force_N = 0;            ///< instead of that highest force
  double pitch_mm = 1.25;        ///< of the maps
  std::array<double, 3> block_mm = {40, 40, 20};
  double young_Pa = 4000;
};

/// Reads the frames while each press loads and averages those near each force: gray less the untouched image,
/// by the sensor's calibration to pressure, to means around nodes. Clocks of recording and gauge are brought
/// together by the window's light. Nodes with more than one in fifty pixels at the camera's limit are not
/// seen. `notes` hears what to know of them. Throws Error(Failure::Input) on a sensor that does not read
/// pressure, a press without a frame near a force, or a gauge that does not belong to it.
std::vector<lump::ScanPress> read_presses(const std::vector<RecordedPress>& presses,
                                          const RecordedOptions& options, std::vector<std::string>& notes,
                                          const RunWatch& watch);

}  // namespace palpate
