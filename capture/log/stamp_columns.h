// The column of a log that says when: found by its name, its unit and its clock by what it holds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace palpate {

/// The clock that stamps a log's rows.
enum class LogStamps : uint8_t {
  None,       ///< no column of times
  Own,        ///< one that starts anywhere
  Monotonic,  ///< this machine's CLOCK_MONOTONIC
  Realtime,   ///< the date: since 1970, or as text of ISO 8601
};

/// A column as it was read: numbers, and dates as seconds since 1970.
struct CellColumn {
  std::string name;
  std::vector<double> values{};  ///< of each row; NaN: neither
  size_t numbers = 0;
  size_t dates = 0;
  size_t others = 0;  ///< cells that hold something else
};

struct StampColumns {
  LogStamps kind = LogStamps::None;
  std::string name;             ///< as it stands
  std::vector<size_t> columns;  ///< that hold the time: none, one, or seconds and nanoseconds
  std::vector<double> time_s;   ///< of each row; NaN: none. Empty with LogStamps::None
};

/// `arrived_s`: of each row; NaN where not known. Throws Error(Failure::Input), which names `where`, for
/// times whose unit neither name, date nor arrivals tell.
StampColumns find_stamps(const std::vector<CellColumn>& columns, std::span<const double> arrived_s,
                         const std::string& where);

/// The middle one of those that are finite; NaN where there is none.
double median_known(std::vector<double> values);

/// Seconds since 1970 of "2026-03-14T15:16:17.25Z", with a blank for the T, with "+01:00" for the Z, or UTC
/// where neither stands; NaN where the text is no such.
double date_s(const std::string& text);

}  // namespace palpate
