#include "capture/run/process/logs_beside.h"

#include <utility>

#include "capture/log/log_input.h"
#include "capture/session/session.h"
#include "engine/base/numbers.h"
#include "palpate/error.h"

namespace palpate {

LogsBeside::LogsBeside(const std::string& input, const std::vector<std::string>& files,
                       std::optional<double> offset_s)
    : offset_s_(offset_s) {
  if (is_session(input)) session_ = session_folder(input);
  for (const std::string& file : files) {
    const LogName log = log_name(file);
    if (!log.is_file())
      throw Error(Failure::Usage, "a file for the log of a recording", "'" + file + "'",
                  "--log robot.csv; palpate record takes - and udp:PORT");
    given_.push_back(read_log(log.what, log.name));
  }
}

void LogsBeside::add(const Touch& touch) {
  const double time_s = 1e-9 * static_cast<double>(touch.time_ns);
  if (!time_s_.empty() && !(time_s > time_s_.back())) return;  // pictures without times
  frames_.push_back(touch.sequence);
  time_s_.push_back(time_s);
  const auto known = [&](bool valid, double value) { return !touch.contact ? 0 : valid ? value : kNaN; };
  force_N_.push_back(known(touch.force_N.valid(), touch.force_N.value));
  depth_mm_.push_back(known(touch.surface.has_value(), touch.surface ? touch.surface->depth_max_mm : kNaN));
  gray_sum_.push_back(known(true, touch.gray_sum));
}

FrameClock LogsBeside::measured_clock() const {
  FrameClock clock;
  clock.time_s = time_s_;
  clock.host_s.assign(time_s_.size(), kNaN);
  clock.signals =
      strongest_signals({{"force_N", force_N_}, {"depth_max_mm", depth_mm_}, {"gray_sum", gray_sum_}});
  return clock;
}

std::vector<AlignedLog> LogsBeside::take(std::vector<std::string>& problems) {
  std::vector<AlignedLog> logs;
  if (frames_.empty()) return logs;
  if (!session_.empty()) logs = session_logs(session_, problems);
  if (given_.empty()) return logs;
  const FrameClock clock = session_.empty() ? measured_clock() : session_clock(session_);
  for (LogTable& table : given_) logs.push_back(align_log(std::move(table), clock, offset_s_));
  given_.clear();
  return logs;
}

void LogsBeside::write(const std::vector<AlignedLog>& logs, const std::filesystem::path& folder) const {
  for (const AlignedLog& log : logs)
    write_log_at_frames(folder / (log.table.name + "_log.csv"), log, frames_, time_s_);
}

}  // namespace palpate
