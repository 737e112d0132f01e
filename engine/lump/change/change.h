// The change of one lump between two days, of which each has an observation of its own.
//
// Two estimates share most of what makes each uncertain: errors of the sensor and of the emulator, the
// tissue, the shape. Here both days are fitted as lumps of one shape at one place of the tissue, so that what
// they share cancels: the change's error is what another press does not repeat (noise, the gauge, where the
// window was put) and the part of the rest that a change of the lump leaves.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "engine/lump/error_sources.h"
#include "engine/lump/network/network.h"

namespace palpate::lump {

enum class ChangeVerdict : uint8_t {
  NoChange,       ///< of the size, beyond what chance makes
  Grown,          ///< the size is more than on the first day
  Shrunk,         ///< the size is less
  Appeared,       ///< a lump where none was seen on the first day
  Gone,           ///< none is seen where one was
  NoLump,         ///< on either day
  NotComparable,  ///< one of the days has no lump that can be measured, or they are unlike: see the reasons
};
const char* to_string(ChangeVerdict verdict);  ///< "no change", "grown", ...

/// From the first day to the second, each with its 90 % interval; NaN without a lump on both.
struct LumpChange {
  ChangeVerdict verdict = ChangeVerdict::NotComparable;
  Value size_mm, depth_mm;  ///< of the diameter, and of the depth of the top
  /// Size, depth and stiffness ratio of the second day over those of the first.
  std::array<Value, 3> factor{};
  bool ratio_changed = false;        ///< beyond what chance makes
  double least_mm = 0;               ///< growth that would be told nine times in ten
  std::array<double, 2> moved_mm{};  ///< of the second day's window against the first's, beyond what was told
  std::vector<std::string> reasons;  ///< one line each, for people
};

/// How far a change has to lie from none to be told, in standard errors that it would have if there were
/// none.
inline constexpr double kTold = 2.3;

/// What was seen on a day, and what was estimated from it alone.
struct Day {
  Observation observation;
  Estimate estimate;
};

/// Compares two days of one block by one sensor. `sources`: modulus, thickness and pitch are off alike on
/// both days, light on each by itself; a window's place by Observation::place_sd_mm. Throws
/// Error(Failure::Usage) where an observation's parts do not fit each other; what cannot be compared has a
/// verdict instead.
LumpChange compare(const Network& network, const Day& first, const Day& second, const ErrorSources& sources);

/// "has grown by 0.9 mm (0.6 to 1.2)", "no change of the size: growth of 0.3 mm would be seen", ...
std::string sentence_of(const LumpChange& change);

}  // namespace palpate::lump
