#include "capture/log/stamp_columns.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "capture/files/tables/csv_table.h"
#include "engine/base/numbers.h"
#include "palpate/error.h"

namespace palpate {
namespace {

struct TimeUnit {
  const char* name;
  double s;
};
constexpr std::array kTimeUnits = {TimeUnit{"s", 1}, TimeUnit{"ms", 1e-3}, TimeUnit{"us", 1e-6},
                                   TimeUnit{"ns", 1e-9}};
// Names in small letters, the surer ones first.
constexpr std::array kMonotonic = {"host_time", "monotonic_time", "monotonic", "time_monotonic"};
constexpr std::array kTimes = {"timestamp", "time_stamp", "stamp",     "header.stamp", "time",     "datetime",
                               "date_time", "date",       "unix_time", "epoch",        "ros_time", "t"};
// Seconds from 2001 to 2286.
constexpr double kFirstDate_s = 1e9, kLastDate_s = 1e10;

std::optional<double> unit_s(const std::string& unit) {
  for (const TimeUnit& known : kTimeUnits)
    if (unit == known.name || (unit == "sec" && known.s == 1)) return known.s;
  return std::nullopt;
}

struct Candidate {
  size_t column = 0;
  std::optional<double> unit_s;
  bool monotonic = false;
};

std::optional<Candidate> candidate(const std::vector<CellColumn>& columns) {
  for (const bool monotonic : {true, false}) {
    const auto wanted =
        monotonic ? std::span<const char* const>(kMonotonic) : std::span<const char* const>(kTimes);
    for (const char* name : wanted)
      for (size_t c = 0; c < columns.size(); ++c) {
        const ColumnHeader header = column_header(columns[c].name);
        if (lower(columns[c].name) == name) return Candidate{c, std::nullopt, monotonic};
        const std::optional<double> unit = unit_s(header.unit);
        if (header.name == name && unit) return Candidate{c, unit, monotonic};
      }
  }
  return std::nullopt;
}

/// Columns of seconds and of the nanoseconds beyond, as of ROS.
std::optional<std::array<size_t, 2>> parted(const std::vector<CellColumn>& columns) {
  for (size_t c = 0; c < columns.size(); ++c) {
    const std::string name = lower(columns[c].name);
    for (const char* end : {"stamp.sec", "stamp.secs", "stamp_sec", "stamp.seconds"}) {
      if (!name.ends_with(end)) continue;
      const std::string stem =
          name.substr(0, name.size() - std::string_view(end).size()) + std::string(end).substr(0, 6);
      for (size_t d = 0; d < columns.size(); ++d)
        for (const char* nano : {"nanosec", "nsec", "nsecs", "nanoseconds"})
          if (lower(columns[d].name) == stem + nano) return std::array{c, d};
    }
  }
  return std::nullopt;
}

/// The unit that makes the stamps run as fast as the lines arrived; none where that is not clear.
std::optional<double> unit_by_arrivals(std::span<const double> stamps, std::span<const double> arrived_s) {
  std::vector<double> ratios;
  const size_t half = stamps.size() / 2;
  for (size_t i = 0; i < half; ++i) {
    const double came = arrived_s[i + half] - arrived_s[i], stamped = stamps[i + half] - stamps[i];
    if (came > 0 && stamped > 0) ratios.push_back(came / stamped);
  }
  const double ratio = median_known(std::move(ratios));
  for (const TimeUnit& unit : kTimeUnits)
    if (ratio > 0.5 * unit.s && ratio < 2 * unit.s) return unit.s;
  return std::nullopt;
}

std::optional<double> unit_of_date(double value) {
  for (const TimeUnit& unit : kTimeUnits)
    if (value * unit.s >= kFirstDate_s && value * unit.s < kLastDate_s) return unit.s;
  return std::nullopt;
}

}  // namespace

double median_known(std::vector<double> values) {
  std::erase_if(values, [](double v) { return !std::isfinite(v); });
  if (values.empty()) return kNaN;
  const auto middle = values.begin() + static_cast<ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double date_s(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, used = 0;
  double second = 0;
  char between = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d%c%2d:%2d:%lf%n", &year, &month, &day, &between, &hour, &minute,
                  &second, &used) != 7 ||
      (between != 'T' && between != 't' && between != ' '))
    return kNaN;
  const std::chrono::year_month_day date(std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day)));
  if (!date.ok() || hour < 0 || hour > 23 || minute < 0 || minute > 59 || !(second >= 0 && second < 61))
    return kNaN;
  const std::string zone = text.substr(static_cast<size_t>(used));
  double ahead_s = 0;
  if (!zone.empty() && zone != "Z" && zone != "z") {
    char sign = 0;
    int hours = 0, minutes = 0, all = 0;
    if (std::sscanf(zone.c_str(), "%c%2d:%2d%n", &sign, &hours, &minutes, &all) != 3 ||
        static_cast<size_t>(all) != zone.size() || (sign != '+' && sign != '-'))
      return kNaN;
    ahead_s = (sign == '+' ? 60.0 : -60.0) * (60 * hours + minutes);
  }
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  return 86400.0 * static_cast<double>(days) + 3600.0 * hour + 60.0 * minute + second - ahead_s;
}

StampColumns find_stamps(const std::vector<CellColumn>& columns, std::span<const double> arrived_s,
                         const std::string& where) {
  StampColumns found;
  const auto clock = [](double typical_s) {
    return typical_s >= kFirstDate_s && typical_s < kLastDate_s ? LogStamps::Realtime : LogStamps::Own;
  };
  if (const auto pair = parted(columns)) {
    const auto [seconds, nanoseconds] = *pair;
    found.columns = {seconds, nanoseconds};
    found.name = columns[seconds].name;
    found.time_s = columns[seconds].values;
    const std::vector<double>& rest = columns[nanoseconds].values;
    for (size_t i = 0; i < rest.size(); ++i) found.time_s[i] += 1e-9 * rest[i];
    found.kind = clock(median_known(found.time_s));
    return found;
  }
  const std::optional<Candidate> at = candidate(columns);
  if (!at) return found;
  const CellColumn& column = columns[at->column];
  found.columns = {at->column};
  found.name = column.name;
  found.time_s = column.values;
  if (column.numbers == 0 && column.dates == 0)
    throw Error(Failure::Input, "times in column " + printable(found.name) + " of " + where, "none",
                "numbers, or dates such as 2026-03-14T15:16:17.25Z");
  if (column.dates > column.numbers) {
    found.kind = LogStamps::Realtime;
    return found;
  }
  const double typical = median_known(found.time_s);
  std::optional<double> unit = at->unit_s;
  if (!unit) unit = unit_of_date(typical);
  if (!unit) unit = unit_by_arrivals(found.time_s, arrived_s);
  if (!unit)
    throw Error(Failure::Input, "a unit in the name of the column " + printable(found.name) + " of " + where,
                "none", "time_s, time_ms, time_us or time_ns");
  for (double& time : found.time_s) time *= *unit;
  found.kind = at->monotonic ? LogStamps::Monotonic : clock(typical * *unit);
  return found;
}

}  // namespace palpate
