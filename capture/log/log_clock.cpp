#include "capture/log/log_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "palpate/error.h"

namespace palpate {
namespace {

constexpr double kReading_s = 1e-4;     // the least error that is stated of clocks of one machine
constexpr double kForDrift_s = 10;      // shorter logs tell no rate
constexpr double kMostDrift = 1e-3;     // of clocks of quartz, generously
constexpr double kTellingLag_s = 0.02;  // a lag by shape that is worth a warning
constexpr double kCheck = 0.9;          // correlation from which on a shape may contradict stamps
constexpr size_t kMostCompared = 12;    // columns
constexpr double kMostRows = 8000;      // of a shape

[[noreturn]] void fail(const LogTable& log, const std::string& wanted, const std::string& found,
                       const std::string& remedy) {
  throw Error(Failure::Input, wanted + " for the log '" + log.name + "'", found, remedy);
}

size_t end_of_stretch(const LogTable& log, size_t stretch) {
  return stretch + 1 < log.stretches.size() ? log.stretches[stretch + 1] : log.rows();
}

/// Seconds to add to CLOCK_MONOTONIC for the frames' time; NaN: not known.
double frames_offset_s(const FrameClock& frames) {
  std::vector<double> offsets;
  for (size_t i = 0; i < frames.time_s.size(); ++i) offsets.push_back(frames.time_s[i] - frames.host_s[i]);
  return median_known(std::move(offsets));
}

/// True where a row lies within the frames' times, a second around them included.
bool overlaps(const LogTable& log, const LogClock& clock, const FrameClock& frames) {
  if (frames.time_s.empty()) return false;
  const double first = clock.time_s(log, 0), last = clock.time_s(log, log.rows() - 1);
  return last >= frames.time_s.front() - 1 && first <= frames.time_s.back() + 1;
}

/// All rows by one offset.
std::vector<LogClock::Stretch> shifted(double offset_s) {
  return {{.first_row = 0, .origin_s = 0, .offset_s = offset_s, .rate = 1}};
}

/// Stamps of the date where the lines' arrivals do not speak against them.
std::optional<LogClock> by_date(const LogTable& log, const FrameClock& frames, double offset_s) {
  if (!frames.wall) return std::nullopt;
  const double ahead_s = 1e-9 * static_cast<double>(frames.wall->ahead_ns);
  LogClock clock{.by = LogAlignment::Date, .stretches = shifted(offset_s - ahead_s)};
  clock.sd_s = std::max(kReading_s, 1e-9 * static_cast<double>(frames.wall->error_ns));
  std::vector<double> delays;
  for (size_t i = 0; i < log.rows(); ++i)
    if (std::isfinite(log.arrived_s[i])) delays.push_back(log.arrived_s[i] + ahead_s - log.stamp_s[i]);
  const auto [least, most] = std::ranges::minmax_element(delays);
  if (frames.wall_end) {
    const double change_s =
        1e-9 * std::abs(static_cast<double>(frames.wall_end->ahead_ns - frames.wall->ahead_ns));
    // Where the date was set or drifted meanwhile, the truth lies between, unless all lines arrived as if it
    // had not been.
    if (delays.empty() || *most - *least > change_s / 2) clock.sd_s = std::max(*clock.sd_s, change_s / 2);
    if (change_s > kTellingLag_s)
      clock.warnings.push_back(text("the date was set by %.3g s while recording", change_s));
  }
  if (delays.empty()) return overlaps(log, clock, frames) ? std::optional(clock) : std::nullopt;
  if (*least > -0.001 && *least < kLatest_s) return clock;
  return std::nullopt;
}

std::optional<LogClock> by_arrivals(const LogTable& log, double offset_s) {
  const bool stamped = log.stamps != LogStamps::None;
  LogClock clock{.by = stamped ? LogAlignment::Fastest : LogAlignment::Arrival, .stretches = {}};
  if (!stamped) {
    if (std::ranges::any_of(log.arrived_s, [](double at) { return !std::isfinite(at); })) return std::nullopt;
    clock.stretches = shifted(offset_s);
    return clock;
  }
  double sd_s = 0;
  for (size_t s = 0; s < log.stretches.size(); ++s) {
    std::vector<double> stamps, arrivals;
    for (size_t row = log.stretches[s]; row < end_of_stretch(log, s); ++row) {
      if (!std::isfinite(log.arrived_s[row])) continue;
      stamps.push_back(log.stamp_s[row]);
      arrivals.push_back(log.arrived_s[row]);
    }
    if (stamps.empty()) return std::nullopt;
    const FastestArrivals found = fastest_arrivals(stamps, arrivals);
    clock.stretches.push_back({log.stretches[s], found.origin_s, found.offset_s + offset_s, found.rate});
    sd_s = std::max(sd_s, found.sd_s);
  }
  clock.sd_s = sd_s;
  return clock;
}

struct ShapeMatch {
  TimeAlignment found;
  std::string of;
};

bool is_force(const LogColumn& column) {
  return column.unit == "N" || column.unit == "mN" || column.unit == "kN";
}

/// The column that goes best with what was measured, of either sign, those of forces first, or of them alone.
std::optional<ShapeMatch> by_shape(const LogTable& log, std::span<const double> row_time_s,
                                   const FrameClock& frames, bool forces_alone) {
  std::vector<const LogColumn*> columns;
  for (const LogColumn& column : log.columns)
    if (!forces_alone || is_force(column)) columns.push_back(&column);
  std::stable_partition(columns.begin(), columns.end(), [](const LogColumn* c) { return is_force(*c); });
  if (columns.size() > kMostCompared) columns.resize(kMostCompared);
  const double step_s = (row_time_s.back() - row_time_s.front()) / kMostRows;
  std::optional<ShapeMatch> best;
  for (const FrameClock::Signal& signal : frames.signals) {
    std::vector<double> time_s, values;
    for (size_t i = 0; i < frames.time_s.size(); ++i) {
      if (!std::isfinite(signal.values[i])) continue;
      time_s.push_back(frames.time_s[i]);
      values.push_back(signal.values[i]);
    }
    for (const LogColumn* column : columns)
      for (const double sign : {1.0, -1.0}) {
        std::vector<double> row_s, signed_values;
        for (size_t i = 0; i < column->values.size(); ++i) {
          if (!std::isfinite(column->values[i]) ||
              (!row_s.empty() && !(row_time_s[i] - row_s.back() > step_s)))
            continue;
          row_s.push_back(row_time_s[i]);
          signed_values.push_back(sign * column->values[i]);
        }
        try {
          const TimeAlignment found = align_in_time(time_s, values, row_s, signed_values);
          if (!best || found.correlation > best->found.correlation)
            best = {found, "column '" + column->name + "' and " + signal.name};
        } catch (const Error&) {
          // Not this pair.
        }
      }
  }
  return best;
}

std::vector<double> row_times(const LogTable& log, const LogClock& clock) {
  std::vector<double> times(log.rows());
  for (size_t row = 0; row < times.size(); ++row) times[row] = clock.time_s(log, row);
  return times;
}

/// The lag that is left where stamps have aligned the two: an instrument's own delay, or a wrong stamp.
void check_by_shape(const LogTable& log, const FrameClock& frames, LogClock& clock) {
  const std::optional<ShapeMatch> match = by_shape(log, row_times(log, clock), frames, true);
  if (!match || match->found.correlation < kCheck) return;
  clock.shape = match->found;
  clock.shape_of = match->of;
  const double lag_s = std::abs(match->found.offset_s);
  if (lag_s > std::max(kTellingLag_s, 3 * std::hypot(match->found.sd_s, clock.sd_s.value_or(0))))
    clock.warnings.push_back(text("by their shapes (%s) the log is %.3g s %s than its stamps say",
                                  match->of.c_str(), lag_s, match->found.offset_s < 0 ? "later" : "earlier"));
}

LogClock aligned(const LogTable& log, const FrameClock& frames) {
  const double offset_s = frames_offset_s(frames);
  const bool same_host = std::isfinite(offset_s);
  if (log.stamps == LogStamps::Monotonic && same_host) {
    LogClock clock{.by = LogAlignment::Monotonic, .stretches = shifted(offset_s)};
    clock.sd_s = kReading_s;
    if (overlaps(log, clock, frames)) return clock;
  }
  if (same_host && log.stamps == LogStamps::Realtime && log.stretches.size() == 1)
    if (const auto clock = by_date(log, frames, offset_s)) return *clock;
  if (same_host)
    if (auto clock = by_arrivals(log, offset_s)) {
      if (log.stamps == LogStamps::Realtime)
        clock->warnings.emplace_back(
            "its dates are another machine's, or were set: they are taken as a clock of "
            "their own");
      return *clock;
    }
  std::vector<double> time_s = log.stamps == LogStamps::None ? log.arrived_s : log.stamp_s;
  if (log.stretches.size() > 1 || std::ranges::any_of(time_s, [](double t) { return !std::isfinite(t); }))
    fail(log, "times", "a log without a column of times", "a column time_s, or lines sent while recording");
  const std::optional<ShapeMatch> match = by_shape(log, time_s, frames, false);
  if (!match)
    fail(log, "a clock that is the recording's, or a column that rises and falls with the touch",
         log.stamps == LogStamps::Realtime && same_host ? "dates of another time" : "neither",
         "stamps of the date (time since 1970), or --log-offset SECONDS");
  LogClock clock{.by = LogAlignment::Shape, .stretches = shifted(match->found.offset_s)};
  clock.sd_s = match->found.sd_s;
  clock.shape = match->found;
  clock.shape_of = match->of;
  return clock;
}

}  // namespace

const char* to_string(LogAlignment alignment) {
  switch (alignment) {
    case LogAlignment::Monotonic:
      return "monotonic";
    case LogAlignment::Date:
      return "date";
    case LogAlignment::Fastest:
      return "fastest arrivals";
    case LogAlignment::Arrival:
      return "arrival";
    case LogAlignment::Shape:
      return "shape";
    case LogAlignment::Told:
      return "told";
  }
  return "";
}

double LogClock::time_s(const LogTable& log, size_t row) const {
  const bool arrivals = by == LogAlignment::Arrival || log.stamps == LogStamps::None;
  const double own_s = arrivals ? log.arrived_s[row] : log.stamp_s[row];
  size_t s = stretches.size() - 1;
  while (s > 0 && stretches[s].first_row > row) --s;
  const Stretch& stretch = stretches[s];
  return stretch.offset_s + stretch.rate * (own_s - stretch.origin_s);
}

FastestArrivals fastest_arrivals(std::span<const double> stamp_s, std::span<const double> arrived_s) {
  FastestArrivals line;
  line.origin_s = stamp_s.front();
  const size_t n = stamp_s.size();
  const auto delay = [&](size_t i) { return arrived_s[i] - (stamp_s[i] - line.origin_s); };
  line.offset_s = std::numeric_limits<double>::infinity();
  for (size_t i = 0; i < n; ++i) line.offset_s = std::min(line.offset_s, delay(i));
  if (stamp_s.back() - stamp_s.front() >= kForDrift_s) {
    // Lower convex hull; its edge over the middle of the stamps is the line.
    std::vector<size_t> hull;
    for (size_t i = 0; i < n; ++i) {
      while (hull.size() >= 2) {
        const size_t a = hull[hull.size() - 2], b = hull.back();
        if ((delay(b) - delay(a)) * (stamp_s[i] - stamp_s[a]) <
            (delay(i) - delay(a)) * (stamp_s[b] - stamp_s[a]))
          break;
        hull.pop_back();
      }
      hull.push_back(i);
    }
    double middle = 0;
    for (const double t : stamp_s) middle += t / static_cast<double>(n);
    size_t edge = 1;
    while (edge + 1 < hull.size() && stamp_s[hull[edge]] < middle) ++edge;
    if (hull.size() >= 2) {
      const size_t a = hull[edge - 1], b = hull[edge];
      const double drift = (delay(b) - delay(a)) / (stamp_s[b] - stamp_s[a]);
      if (std::abs(drift) < kMostDrift) {
        line.rate = 1 + drift;
        line.offset_s = delay(a) - drift * (stamp_s[a] - line.origin_s);
      }
    }
  }
  std::vector<double> beyond(n);
  for (size_t i = 0; i < n; ++i)
    beyond[i] = arrived_s[i] - line.offset_s - line.rate * (stamp_s[i] - line.origin_s);
  const auto twentieth = beyond.begin() + static_cast<ptrdiff_t>(n / 20);
  std::nth_element(beyond.begin(), twentieth, beyond.end());
  line.sd_s = std::hypot(*twentieth, kReading_s);
  return line;
}

LogClock find_log_clock(const LogTable& log, const FrameClock& frames, std::optional<double> told_offset_s) {
  if (log.rows() == 0) fail(log, "rows", "none", "another log");
  LogClock clock;
  if (told_offset_s) {
    if (log.stamps == LogStamps::None) fail(log, "a column of times", "none", "leaving --log-offset out");
    clock.by = LogAlignment::Told;
    clock.stretches = shifted(*told_offset_s);
  } else {
    clock = aligned(log, frames);
  }
  if (!overlaps(log, clock, frames))
    fail(log, "rows of the time of the recording",
         text("%.6g s to %.6g s of it, by %s", clock.time_s(log, 0), clock.time_s(log, log.rows() - 1),
              to_string(clock.by)),
         "the log of this recording");
  const bool by_host = clock.by != LogAlignment::Shape && clock.by != LogAlignment::Told;
  if (by_host && clock.sd_s) clock.sd_s = std::hypot(*clock.sd_s, frames.host_sd_s);
  if (clock.by != LogAlignment::Shape) check_by_shape(log, frames, clock);
  return clock;
}

std::string describe(const LogClock& clock) {
  std::string line = std::string("aligned by ") + [&] {
    switch (clock.by) {
      case LogAlignment::Monotonic:
        return "the machine's monotonic clock";
      case LogAlignment::Date:
        return "the date";
      case LogAlignment::Fastest:
        return "its own clock and the lines that arrived soonest";
      case LogAlignment::Arrival:
        return "the arrival of its lines, which is later than what they say";
      case LogAlignment::Shape:
        return "shape";
      case LogAlignment::Told:
        return "the offset that was told";
    }
    return "";
  }();
  if (clock.by == LogAlignment::Shape) line += ", " + clock.shape_of;
  if (clock.sd_s) line += text(", to %.2g ms", 1e3 * *clock.sd_s);
  if (clock.shape && clock.by == LogAlignment::Shape)
    line += text(" (correlation %.3f)", clock.shape->correlation);
  else if (clock.shape)
    line += text("; by shape (%s) %.1f +- %.1f ms later", clock.shape_of.c_str(),
                 -1e3 * clock.shape->offset_s, 1e3 * clock.shape->sd_s);
  for (const std::string& warning : clock.warnings) line += "; warning: " + warning;
  return line;
}

}  // namespace palpate
