#include "capture/log/session_logs.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/files/tables/csv_table.h"
#include "capture/session/info.h"
#include "engine/base/json.h"
#include "engine/base/numbers.h"
#include "engine/base/text.h"
#include "engine/calibrate/time_series.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr double kMargin_s = 1;  // of a log before and after the frames

double half_turn(const LogColumn& column) {
  return column.unit == "rad"   ? std::numbers::pi
         : column.unit == "deg" ? 180
                                : std::numeric_limits<double>::infinity();
}

/// A frame's number from a table, NaN where the cell is empty.
double number(const CsvTable& table, std::optional<size_t> column) {
  return column ? table.number_if_any(*column).value_or(kNaN) : kNaN;
}

/// Where frames lack a time on the host's clock, but were delivered as fast as their times count (a recording
/// that is played), the soonest deliveries stand for it.
void host_times_by_delivery(FrameClock& frames, const std::vector<double>& delivered_s) {
  const bool known = std::ranges::any_of(frames.host_s, [](double t) { return std::isfinite(t); });
  if (known || frames.time_s.size() < 2 ||
      std::ranges::any_of(delivered_s, [](double t) { return !std::isfinite(t); }))
    return;
  const double span_s = frames.time_s.back() - frames.time_s.front();
  const double took_s = delivered_s.back() - delivered_s.front();
  if (!(std::abs(took_s / span_s - 1) < 0.02)) return;
  const FastestArrivals line = fastest_arrivals(frames.time_s, delivered_s);
  frames.host_sd_s = line.sd_s;
  for (size_t i = 0; i < frames.time_s.size(); ++i)
    frames.host_s[i] = line.offset_s + line.rate * (frames.time_s[i] - line.origin_s);
}

std::vector<fs::path> log_files(const fs::path& session) {
  std::vector<fs::path> files;
  std::error_code code;
  for (const fs::directory_entry& entry : fs::directory_iterator(session / kLogFolder, code))
    if (entry.path().extension() == kLogLines) files.push_back(entry.path());
  std::ranges::sort(files);
  return files;
}

std::string csv_of(const AlignedLog& log) {
  std::string text = "time_s";
  for (const LogColumn& column : log.table.columns) text += ',' + csv_cell(column.name);
  text += '\n';
  for (size_t row = 0; row < log.table.rows(); ++row) {
    text += with_places(log.time_s[row], 6);
    for (const LogColumn& column : log.table.columns)
      text += ',' + (std::isfinite(column.values[row]) ? shortest(column.values[row]) : std::string());
    text += '\n';
  }
  return text;
}

json::Value json_of(const AlignedLog& log) {
  json::Value columns = json::Value::array(), stretches = json::Value::array();
  for (const LogColumn& column : log.table.columns)
    columns.push_back({{"name", column.name}, {"unit", column.unit}});
  for (const LogClock::Stretch& s : log.clock.stretches)
    stretches.push_back(
        {{"first_row", s.first_row}, {"origin_s", s.origin_s}, {"offset_s", s.offset_s}, {"rate", s.rate}});
  json::Value json{{"rows", log.table.rows()},
                   {"columns", columns},
                   {"time_column", log.table.time_column},
                   {"aligned_by", to_string(log.clock.by)},
                   {"sd_s", log.clock.sd_s ? json::Value(*log.clock.sd_s) : json::Value()},
                   {"clock", stretches},
                   {"notes", log.table.notes},
                   {"warnings", log.clock.warnings}};
  if (log.clock.shape)
    json["shape"] = {{"of", log.clock.shape_of},
                     {"lag_s", -log.clock.shape->offset_s},
                     {"lag_sd_s", log.clock.shape->sd_s},
                     {"correlation", log.clock.shape->correlation}};
  return json;
}

}  // namespace

std::optional<double> AlignedLog::at(const LogColumn& column, double when_s) const {
  if (time_s.empty() || !(when_s >= time_s.front() && when_s <= time_s.back())) return std::nullopt;
  const SeriesPlace at = place_in(time_s, when_s);
  if (time_s[at.to] - time_s[at.from] > widest_gap_s_) return std::nullopt;
  const double before = column.values[at.from], next = column.values[at.to];
  const bool turned = std::abs(next - before) > half_turn(column);
  const double value = turned ? (at.share < 0.5 ? before : next) : at.of(column.values);
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

AlignedLog align_log(LogTable table, const FrameClock& frames, std::optional<double> told_offset_s) {
  AlignedLog log;
  log.clock = find_log_clock(table, frames, told_offset_s);
  std::vector<size_t> kept;
  std::vector<double> times;
  for (size_t row = 0; row < table.rows(); ++row) {
    const double time_s = log.clock.time_s(table, row);
    const bool within =
        time_s >= frames.time_s.front() - kMargin_s && time_s <= frames.time_s.back() + kMargin_s;
    if (!within || (!times.empty() && !(time_s > times.back()))) continue;
    kept.push_back(row);
    times.push_back(time_s);
  }
  if (kept.size() < table.rows())
    table.notes.push_back(std::to_string(table.rows() - kept.size()) +
                          " rows of other times than the recording's left out");
  pick_rows(table, kept);
  log.table = std::move(table);
  log.time_s = std::move(times);
  log.widest_gap_s_ = longest_step(log.time_s);
  return log;
}

std::vector<FrameClock::Signal> strongest_signals(std::vector<FrameClock::Signal> signals) {
  std::erase_if(signals, [](const FrameClock::Signal& signal) {
    const auto known = std::ranges::count_if(signal.values, [](double v) { return std::isfinite(v); });
    return 2 * static_cast<size_t>(known) <= signal.values.size();
  });
  if (signals.size() > 2) signals.resize(2);
  return signals;
}

FrameClock session_clock(const fs::path& session) {
  FrameClock frames;
  const CsvOptions whole_lines{.separators = ",", .width = CsvWidth::Any};
  CsvTable table(session / kSessionRows, "the rows of a session", whole_lines);
  const size_t time = table.require({"time_s"})[0];
  const auto column = [&](const char* name) { return table.find(name); };
  const auto host = column("host_time_ns"), delivered = column("host_delivered_ns"),
             contact = column("contact");
  constexpr std::array kSignals = {"force_N", "wrench_fz_N", "depth_max_mm", "gray_sum"};
  std::vector<std::optional<size_t>> columns;
  columns.reserve(kSignals.size());
  for (const char* name : kSignals) columns.push_back(column(name));
  std::vector<FrameClock::Signal> signals;
  signals.reserve(kSignals.size());
  for (const char* name : kSignals) signals.push_back({name, {}});
  std::vector<double> delivered_s;
  const size_t width = table.columns().size();
  while (table.next()) {
    if (table.cells().size() != width) continue;  // cut by a kill
    const double time_s = table.number(time);
    if (!frames.time_s.empty() && !(time_s > frames.time_s.back())) continue;
    frames.time_s.push_back(time_s);
    frames.host_s.push_back(1e-9 * number(table, host));
    delivered_s.push_back(1e-9 * number(table, delivered));
    const bool touched = contact && table.cell(*contact) == "1",
               untouched = contact && table.cell(*contact) == "0";
    for (size_t s = 0; s < signals.size(); ++s)
      signals[s].values.push_back(untouched ? 0 : touched ? number(table, columns[s]) : kNaN);
  }
  if (frames.time_s.empty())
    throw Error(Failure::Input, "frames in " + (session / kSessionRows).string(), "none", "another session");
  host_times_by_delivery(frames, delivered_s);
  frames.signals = strongest_signals(std::move(signals));
  const std::string text = session_json(session);
  if (!text.empty()) {
    const SessionText read = session_from_text(text, (session / kSessionJson).string());
    frames.wall = read.clock;
    frames.wall_end = read.end.clock;
  }
  return frames;
}

std::vector<AlignedLog> session_logs(const fs::path& session, std::vector<std::string>& problems,
                                     const FindClock& clock) {
  std::vector<AlignedLog> logs;
  const std::vector<fs::path> files = log_files(session);
  if (files.empty()) return logs;
  const FrameClock frames = clock(session);
  for (const fs::path& file : files) try {
      logs.push_back(align_log(read_log(file, file.stem().string()), frames));
    } catch (const Error& error) {
      problems.push_back(error.what());
    }
  return logs;
}

std::vector<std::string> finish_session_logs(const fs::path& session, const FindClock& clock) {
  std::vector<std::string> lines;
  try {
    for (const AlignedLog& log : session_logs(session, lines, clock)) {
      const fs::path stem = session / kLogFolder / log.table.name;
      write_whole(fs::path(stem) += ".csv", csv_of(log));
      write_whole(fs::path(stem) += ".json", json_of(log).dump(2, json::Utf8::Replace) + "\n");
      lines.push_back(describe(log));
    }
  } catch (const std::exception& error) {
    lines.push_back(error.what());
  }
  return lines;
}

void write_log_at_frames(const fs::path& file, const AlignedLog& log, std::span<const uint64_t> frames,
                         std::span<const double> time_s) {
  std::string text = "frame,time_s";
  for (const LogColumn& column : log.table.columns) text += ',' + csv_cell(column.name);
  text += '\n';
  for (size_t i = 0; i < frames.size(); ++i) {
    text += std::to_string(frames[i]) + ',' + with_places(time_s[i], 6);
    for (const LogColumn& column : log.table.columns) {
      const std::optional<double> value = log.at(column, time_s[i]);
      text += ',' + (value ? shortest(*value) : std::string());
    }
    text += '\n';
  }
  write_whole(file, text);
}

std::string describe(const AlignedLog& log) {
  const double interval_s = usual_step(log.time_s);
  std::string line =
      text("%s: %zu rows of %zu columns", log.table.name.c_str(), log.table.rows(), log.table.columns.size());
  if (interval_s > 0) line += text(" at %.3g Hz", 1 / interval_s);
  line += ", " + describe(log.clock);
  for (const std::string& note : log.table.notes) line += "; " + note;
  return line;
}

}  // namespace palpate
