// The clock of a log beside that of a recording's frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "capture/log/log_table.h"
#include "engine/base/clock.h"
#include "engine/calibrate/time_alignment.h"

namespace palpate {

/// Times of a recording's frames, and what was measured of them.
struct FrameClock {
  struct Signal {
    std::string name;
    std::vector<double> values;  ///< of each frame; NaN: none
  };
  std::vector<double> time_s;               ///< as measurements.csv counts; rising
  std::vector<double> host_s;               ///< the same instants on CLOCK_MONOTONIC; NaN: not known
  double host_sd_s = 0;                     ///< of these
  std::optional<WallClock> wall, wall_end;  ///< when the recording began and ended
  std::vector<Signal> signals;              ///< that rise with a press
};

/// How a log's times became those of the frames.
enum class LogAlignment : uint8_t {
  Monotonic,  ///< both were stamped by CLOCK_MONOTONIC
  Date,       ///< the log by the date, whose clock is known beside the frames'
  Fastest,    ///< the log's clock by the lines that arrived soonest
  Arrival,    ///< no stamps: each line counts from when it arrived
  Shape,      ///< by the lag at which a column goes best with what was measured
  Told,       ///< somebody said the offset
};
const char* to_string(LogAlignment alignment);

struct LogClock {
  /// frames' time = offset_s + rate * (row's time - origin_s), from its first row on.
  struct Stretch {
    size_t first_row = 0;
    double origin_s = 0, offset_s = 0, rate = 1;
  };
  LogAlignment by = LogAlignment::Arrival;
  std::vector<Stretch> stretches{};
  std::optional<double> sd_s{};          ///< standard error; none: not known
  std::optional<TimeAlignment> shape{};  ///< found by shape, or its check: the lag that is left
  std::string shape_of{};                ///< "column 'fz_N' and force_N"
  std::vector<std::string> warnings{};

  /// Time of a row as the frames count.
  double time_s(const LogTable& log, size_t row) const;
};

/// Stamps come first, then arrivals, then shape. Stamps of the date are taken where the lines arrived within
/// kLatest_s of them, or where that is not known and both overlap; otherwise they are another machine's, and
/// a clock as any. Where stamps align the two, a column that goes well with what was measured is the check.
/// `told_offset_s`: to be added to the log's times. Throws Error(Failure::Input) where nothing tells.
LogClock find_log_clock(const LogTable& log, const FrameClock& frames,
                        std::optional<double> told_offset_s = std::nullopt);

/// A line of the date that takes longer to arrive is another machine's.
inline constexpr double kLatest_s = 0.05;

/// The line below all arrivals that lies nearest to them: arrival = offset + rate * (stamp - origin) at the
/// least delay (S. Moon, P. Skelly, D. Towsley, Estimation and removal of clock skew from network delay
/// measurements, 1999). Stamps rise. Over less than ten seconds the rate is taken as 1.
struct FastestArrivals {
  double origin_s = 0, offset_s = 0, rate = 1;
  double sd_s = 0;  ///< delay beyond the line of one line in twenty, and a tenth of a millisecond
};
FastestArrivals fastest_arrivals(std::span<const double> stamp_s, std::span<const double> arrived_s);

/// "aligned by the date to 0.1 ms; ..." one line.
std::string describe(const LogClock& clock);

}  // namespace palpate
