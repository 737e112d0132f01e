#include "perf/profile/report/answers.h"

#include <algorithm>

#include "engine/base/text.h"

namespace palpate::perf {
namespace {

/// The largest frame of a reading that reaches so many a second; null: none does.
const SizeFigure* largest_of(const Profile& profile, const std::string& reading, double least_Hz = 0) {
  const SizeFigure* largest = nullptr;
  for (const SizeFigure& s : profile.sizes)
    if (s.reading == reading && s.frames_per_s >= least_Hz && (!largest || s.pixels() > largest->pixels()))
      largest = &s;
  return largest;
}

}  // namespace

std::vector<std::string> readings_of(const Profile& profile) {
  std::vector<std::string> readings;
  for (const SizeFigure& s : profile.sizes)
    if (std::find(readings.begin(), readings.end(), s.reading) == readings.end())
      readings.push_back(s.reading);
  return readings;
}

std::string headline(const Profile& profile) {
  constexpr double kCamera_Hz = 30;
  const std::vector<std::string> readings = readings_of(profile);
  if (readings.empty()) return "No frame was measured.";
  std::string words = "30 frames/s on this machine: ";
  for (size_t i = 0; i < readings.size(); ++i) {
    if (i > 0) words += i + 1 == readings.size() ? " and " : ", ";
    const SizeFigure* size = largest_of(profile, readings[i], kCamera_Hz);
    words += readings[i];
    if (!size) {
      words += " at no size that was measured";
      continue;
    }
    // Only a larger size that was measured and is slower is a limit.
    const bool limit = size != largest_of(profile, readings[i]);
    words += (limit ? " up to " : " at ") + size_text(size->width_px, size->height_px);
    if (!limit) words += " (larger frames were not tried)";
  }
  return words + ".";
}

std::string slowest_stage(const Profile& profile, const std::string& reading) {
  const SizeFigure* size = largest_of(profile, reading);
  if (!size || size->stages.empty()) return "Time of each stage, " + reading;
  const auto slowest = std::max_element(
      size->stages.begin(), size->stages.end(),
      [](const StageFigure& a, const StageFigure& b) { return a.time.median_ms < b.time.median_ms; });
  return text("%s: '%s' takes most, %.3g of %.3g ms at %s", reading.c_str(), slowest->stage.c_str(),
              slowest->time.median_ms, size->latency.median_ms,
              size_text(size->width_px, size->height_px).c_str());
}

std::string usual_latency(const Profile& profile, const std::string& reading) {
  const SizeFigure* size = largest_of(profile, reading);
  if (!size || size->latency.samples == 0) return "Time of single frames, " + reading;
  return text("%s: 99 of 100 frames of %s are done within %.3g ms", reading.c_str(),
              size_text(size->width_px, size->height_px).c_str(), size->latency.p99_ms);
}

std::string best_bandwidth(const Profile& profile, const std::string& reading) {
  double best = 0;
  std::string stage;
  for (const SizeFigure& s : profile.sizes)
    for (const StageFigure& f : s.stages)
      if (s.reading == reading && f.GB_per_s > best) {
        best = f.GB_per_s;
        stage = f.stage;
      }
  if (!(profile.ceiling.GB_per_s > 0) || stage.empty()) return "Bandwidth of each stage, " + reading;
  return text("%s: '%s' comes nearest to copying, %.0f %% of it", reading.c_str(), stage.c_str(),
              100 * best / profile.ceiling.GB_per_s);
}

}  // namespace palpate::perf
