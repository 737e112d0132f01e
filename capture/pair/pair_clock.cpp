#include "capture/pair/pair_clock.h"

#include <map>

#include "capture/files/tables/csv_table.h"
#include "capture/log/session_logs.h"
#include "capture/pair/pair_files.h"
#include "capture/session/info.h"
#include "palpate/error.h"

namespace fs = std::filesystem;

namespace palpate {
namespace {

constexpr CsvOptions kWholeLines{.separators = ",", .width = CsvWidth::Any};  // a kill may cut the last one

/// Times of a session's frames.
std::map<uint64_t, double> times_of(const fs::path& session) {
  CsvTable table(session / kSessionRows, "the rows of a session", kWholeLines);
  const std::vector<size_t> columns = table.require({"frame", "time_s"});
  std::map<uint64_t, double> times;
  while (table.next())
    if (table.cells().size() == table.columns().size())
      times[static_cast<uint64_t>(table.number(columns[0]))] = table.number(columns[1]);
  return times;
}

}  // namespace

std::optional<double> pair_offset_s(const fs::path& session, const fs::path& rows, Side side) {
  const std::map<uint64_t, double> times = times_of(session);
  CsvTable table(rows, "the rows of two fingers", kWholeLines);
  const std::vector<size_t> columns =
      table.require({"time_s", side == Side::Left ? "left_frame" : "right_frame", "skew_ms"});
  while (table.next()) {
    if (table.cells().size() != table.columns().size()) continue;
    const std::optional<double> frame = table.number_if_any(columns[1]);
    if (!frame) continue;
    const auto found = times.find(static_cast<uint64_t>(*frame));
    if (found == times.end()) continue;
    // A pair's row is in the middle of both frames.
    const double half_skew_s = 0.5e-3 * table.number_if_any(columns[2]).value_or(0);
    return table.number(columns[0]) + (side == Side::Left ? -half_skew_s : half_skew_s) - found->second;
  }
  return std::nullopt;
}

FrameClock pair_clock(const fs::path& folder, const fs::path& rows) {
  for (const Side side : kSides) {
    const fs::path session = finger_folder(folder, side);
    const std::optional<double> offset_s = pair_offset_s(session, rows, side);
    if (!offset_s) continue;
    FrameClock clock = session_clock(session);
    for (double& time_s : clock.time_s) time_s += *offset_s;
    return clock;
  }
  throw Error(Failure::Input, "rows in " + rows.string(), "none", "another pair");
}

}  // namespace palpate
