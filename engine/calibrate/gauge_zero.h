// Zero of a force gauge: its readings while nothing touches.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace palpate {

/// In the readings' unit.
struct GaugeZero {
  double offset = 0;    ///< mean of the readings
  double sd = 0;        ///< its standard error; neighbouring readings err alike
  double rise = 0;      ///< within a stretch, from its first reading to its last, on average
  double spread = 0;    ///< between the means of stretches without a touch, of those that do not rise or fall
  double range = 0;     ///< largest distance of a reading of the recording from the offset, or as given
  size_t readings = 0;  ///< untouched ones that were used

  /// Whether the offset is more than its error and more than a five hundredth of the range, and the readings
  /// rise by no more than half of it: those that do belong to a touch that is not seen.
  bool differs() const;
  /// Whether stretches agree within a tenth of the range.
  bool steady() const;
};

/// Sign of a column's readings while something presses.
enum class Pressed : uint8_t {
  Above,   ///< the normal force
  Either,  ///< a tangential one
};

/// `reading` of each frame in order, NaN: none; `touched` frames are those in which something is seen to
/// touch. A touch begins before it is seen: of each stretch of untouched frames the half that lies farthest
/// from a touch counts, and of a normal force the lowest stretches alone. `least_range`: where the column is
/// one of several and may read next to nothing. None with fewer than 2 readings there.
std::optional<GaugeZero> find_gauge_zero(std::span<const double> reading, const std::vector<bool>& touched,
                                         Pressed pressed, double least_range = 0);

}  // namespace palpate
