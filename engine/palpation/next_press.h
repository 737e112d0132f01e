// Where a scan of a block is pressed next: where a press would narrow a lump's intervals most, or show most
// of what was not seen yet.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/lump/observation/scan_stitch.h"

namespace palpate {

namespace lump {
struct Model;
}

struct NextPress {
  std::array<double, 2> at_mm{};  ///< the window's middle, from the block's
  std::array<double, 2> window_mm{};
  double force_N = 0;  ///< highest, on the whole block: that of the scan
  /// Lengths of the intervals of size, depth and stiffness ratio (of logarithms) with it over those without;
  /// NaN where no lump is known yet.
  std::array<double, 3> narrower{};
  double shows_fraction = 0;  ///< of the block, what it shows that was not seen
  /// A force at which all presses again, this one with them, would narrow the intervals by a tenth more: half
  /// as much again as the scan's, or what the network knows and the sensor reads. 0: none.
  double harder_N = 0;
  double harder_peak_Pa = 0;  ///< the highest pressure then
  std::array<double, 3> harder_narrower{};
  std::string reason;  ///< one line, for people
};

struct NextPressOptions {
  std::array<double, 2> window_mm = {27.84, 20.88};  ///< what a press shows
  double full_scale_Pa = 0;  ///< the highest pressure that the sensor reads; 0: not known
  double worth = 0.05;       ///< a press that narrows the intervals by less (geometric mean) is none
};

/// The best of the places on a raster of 2 mm at which the window hangs over the block's rim by 1.5 mm at
/// most. Where the estimate has a lump: that of the least product of the intervals' lengths, as the
/// emulator's bump tells them from the nodes and the noise that the map would have then. Where it has none:
/// that which shows most of what was not seen. None: no place is worth it, or the whole block was seen
/// without a lump.
std::optional<NextPress> next_press(const lump::Model& model, const lump::ScanMap& map,
                                    const lump::Estimate& estimate, const NextPressOptions& options = {});

/// Corners of its window.
std::array<std::array<double, 2>, 4> corners_of(const NextPress& next);

/// The rows of a table for people; of none why there is none.
std::vector<std::pair<std::string, std::string>> next_press_rows(const std::optional<NextPress>& next,
                                                                 const lump::Estimate& estimate);

}  // namespace palpate
