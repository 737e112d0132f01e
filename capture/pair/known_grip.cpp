#include "capture/pair/known_grip.h"

#include <cmath>
#include <utility>

#include "capture/files/measurements.h"
#include "capture/files/output_file.h"
#include "capture/files/tables/csv_table.h"
#include "capture/synthetic/synthetic.h"
#include "engine/calibrate/time_series.h"
#include "palpate/error.h"

namespace palpate {

OpeningSeries::OpeningSeries(const OpeningSource& source) : fixed_mm_(source.fixed_mm), sd_mm_(source.sd_mm) {
  if (source.log.empty()) return;
  CsvTable table(source.log, "a log of the gripper's opening");
  const std::vector<size_t> columns = table.require({"time_s", source.column});
  while (table.next()) {
    const double time_s = table.number(columns[0]);
    if (!times_s_.empty() && time_s <= times_s_.back())
      throw Error(Failure::Input, "times that rise in a log of the gripper's opening", table.where(),
                  "sorting it by time_s");
    times_s_.push_back(time_s);
    openings_mm_.push_back(table.number(columns[1]));
  }
}

Estimate OpeningSeries::at(double time_s) const {
  if (fixed_mm_) return {*fixed_mm_, sd_mm_, Validity::Valid};
  if (times_s_.empty() || time_s < times_s_.front() || time_s > times_s_.back()) return {};
  return {place_in(times_s_, time_s).of(openings_mm_), sd_mm_, Validity::Valid};
}

OpeningSeries OpeningSeries::from(double time_s) const {
  OpeningSeries later = *this;
  for (double& time : later.times_s_) time -= time_s;
  return later;
}

void OpeningSeries::write(const std::filesystem::path& file) const {
  std::string text = "time_s,opening_mm\n";
  for (size_t i = 0; i < times_s_.size(); ++i)
    text += shortest(times_s_[i]) + ',' + shortest(openings_mm_[i]) + '\n';
  write_whole(file, text);
}

GripFile KnownGrip::keep(const std::filesystem::path& folder) const {
  GripFile kept = file;
  if (!opening.changes()) return kept;
  opening.write(folder / kOpeningLog);
  kept.opening.log = kOpeningLog;  // beside pair.json, wherever the folder is moved to
  kept.opening.column = "opening_mm";
  return kept;
}

KnownGrip known_grip(const GripFile& file) {
  return {file, OpeningSeries(file.opening)};
}

std::optional<KnownGrip> simulated_grip(const std::string& left, const std::string& right) {
  constexpr const char* kScene = "synthetic:grip?";
  constexpr double kLogStep_s = 0.01, kEndless_s = 600;
  if (!left.starts_with(kScene) || !right.starts_with(kScene)) return std::nullopt;
  const SyntheticOptions scene = parse_synthetic(left);
  KnownGrip grip;
  grip.file.geometry.pads[0].rotation = {{{0, 0, -1}, {1, 0, 0}, {0, -1, 0}}};
  grip.file.geometry.pads[1].rotation = {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}};
  const std::optional<uint64_t> frames = SyntheticSensor(scene).frame_count();
  const double end_s = frames ? 1 + static_cast<double>(*frames) / scene.rate_Hz : kEndless_s;
  const GripScript script(scene);
  std::vector<double> times_s, openings_mm;
  const double round_steps = script.round_s() / kLogStep_s;
  const bool repeats = std::abs(round_steps - std::round(round_steps)) < 1e-6;  // step by step
  for (size_t k = 0; kLogStep_s * static_cast<double>(k) < end_s; ++k) {
    times_s.push_back(kLogStep_s * static_cast<double>(k));
    const bool again = repeats && static_cast<double>(k) > round_steps;
    openings_mm.push_back(again ? openings_mm[k - static_cast<size_t>(std::round(round_steps))]
                                : script.at(times_s.back()).opening_mm);
  }
  grip.opening = OpeningSeries(std::move(times_s), std::move(openings_mm));
  return grip;
}

}  // namespace palpate
